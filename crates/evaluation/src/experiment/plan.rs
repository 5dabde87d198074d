//! What an experiment varies.

use super::Nuisance;
use super::labels::{estimator_label, metric_label, unusual};
use congruent_estimators::EstimatorConfig;
use congruent_geometry::{Length, numbers};
use congruent_metrics::MetricConfig;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// One table or figure. Every list is swept, all against all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Plan {
    /// Of the result.
    pub title: String,
    /// How gaps of the paper were settled; printed with the result.
    #[serde(default)]
    pub notes: Vec<String>,
    /// What is measured.
    #[serde(default)]
    pub shows: Shows,
    /// What the rows of the table are.
    #[serde(default = "rows")]
    pub rows: Axis,
    /// What its columns are. Whatever else varies makes more tables.
    #[serde(default = "columns")]
    pub columns: Axis,
    /// Changes to the chain before the estimator.
    #[serde(default = "unchanged")]
    pub variants: Vec<Variant>,
    /// What the target is spoilt with.
    #[serde(default = "unspoilt")]
    pub nuisances: Vec<Nuisance>,
    /// Each proposes its own stream of poses.
    #[serde(default = "plain")]
    pub estimators: Vec<EstimatorConfig>,
    /// All rank the same stream.
    #[serde(default)]
    pub metrics: Vec<MetricConfig>,
    /// Thresholds of all metrics, in `pr` of the chain.
    #[serde(default = "paper_threshold", deserialize_with = "numbers::all_positive")]
    pub thresholds_pr: Vec<f64>,
    /// How much of the stream is looked at.
    #[serde(default = "paper_iterations")]
    pub iterations: Vec<u64>,
    /// Bounds at which a pose counts as right, in `pr` of `measured-on`.
    #[serde(default = "paper_bound", deserialize_with = "numbers::all_positive")]
    pub d_rmse: Vec<f64>,
    /// Which points errors are measured on, and whose resolution is their `pr`.
    #[serde(default)]
    pub measured_on: MeasuredOn,
    /// Compare every metric with this one by McNemar's exact test.
    #[serde(default)]
    pub baseline: Option<String>,
}

/// What an experiment measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shows {
    /// How often the best pose is right.
    #[default]
    Accuracy,
    /// How many matches are true, and which share of them; nothing is proposed.
    Inliers,
    /// How long a metric takes for one pose; nothing is ranked.
    Time,
}

/// A change to the configuration, as `--set` takes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Variant {
    /// What the tables call it.
    pub name: String,
    /// `key=value`, applied in order.
    pub set: Vec<String>,
}

/// Which points errors are measured on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasuredOn {
    /// The scans as they came, as `congruent evaluate` does.
    #[default]
    Scans,
    /// The sampled clouds, as the paper's authors do; their `pr` is larger.
    Sampled,
}

/// Something that varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Where the pairs come from.
    Dataset,
    /// Changes to the chain.
    Variant,
    /// What the target is spoilt with.
    Nuisance,
    /// Who proposes.
    Estimator,
    /// Who ranks.
    Metric,
    /// The inlier threshold, `pr`.
    Threshold,
    /// How much of the stream is looked at.
    Iterations,
    /// The bound of a right pose, `pr`.
    DRmse,
}

impl Axis {
    /// All of them.
    pub const ALL: [Axis; 8] = [
        Axis::Dataset,
        Axis::Variant,
        Axis::Nuisance,
        Axis::Estimator,
        Axis::Iterations,
        Axis::Metric,
        Axis::Threshold,
        Axis::DRmse,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Axis::Dataset => "data set",
            Axis::Variant => "variant",
            Axis::Nuisance => "nuisance",
            Axis::Estimator => "estimator",
            Axis::Metric => "metric",
            Axis::Threshold => "t (pr)",
            Axis::Iterations => "iterations",
            Axis::DRmse => "d_rmse (pr)",
        }
    }
}

fn rows() -> Axis {
    Axis::Metric
}

fn columns() -> Axis {
    Axis::Dataset
}

fn unchanged() -> Vec<Variant> {
    vec![Variant { name: "as configured".to_owned(), set: Vec::new() }]
}

fn unspoilt() -> Vec<Nuisance> {
    vec![Nuisance::None {}]
}

fn plain() -> Vec<EstimatorConfig> {
    vec![EstimatorConfig::default()]
}

fn paper_threshold() -> Vec<f64> {
    vec![7.5]
}

fn paper_iterations() -> Vec<u64> {
    vec![1000]
}

fn paper_bound() -> Vec<f64> {
    vec![2.5]
}

impl Plan {
    /// What the plan says twice, or says and does not mean; nothing for a plan that can be run.
    #[must_use]
    pub fn contradiction(&self) -> Option<String> {
        let metrics: Vec<Cow<'_, str>> = self.metrics.iter().map(metric_label).collect();
        let estimators: Vec<Cow<'_, str>> = self.estimators.iter().map(estimator_label).collect();
        let threshold = self.metrics.iter().position(|metric| unusual(metric).contains_key("threshold"));
        let iterations = self.estimators.iter().position(|estimator| unusual(estimator).contains_key("iterations"));
        let twice = repeated(&metrics).or_else(|| repeated(&estimators));
        let baseline = self.baseline.as_ref().filter(|baseline| !metrics.iter().any(|metric| metric == *baseline));
        if let Some(at) = threshold {
            Some(format!("the threshold of {} has no effect; write `thresholds-pr`, for all metrics", metrics[at]))
        } else if let Some(at) = iterations {
            Some(format!("the iterations of {} have no effect; write `iterations`, for all estimators", estimators[at]))
        } else if let Some(name) = twice {
            Some(format!("{name} is listed twice"))
        } else {
            baseline
                .map(|name| format!("the baseline `{name}` is none of its metrics; they are {}", metrics.join(", ")))
        }
    }
}

/// The first that stands after an equal one.
fn repeated<'a>(names: &'a [Cow<'a, str>]) -> Option<&'a str> {
    (1..names.len()).find(|&at| names[..at].contains(&names[at])).map(|at| &*names[at])
}

/// The same metric at another threshold.
pub(crate) fn at_threshold(metric: &MetricConfig, threshold_pr: f64) -> MetricConfig {
    let mut metric = metric.clone();
    let place = match &mut metric {
        MetricConfig::InlierCount(c)
        | MetricConfig::Mae(c)
        | MetricConfig::Mse(c)
        | MetricConfig::LogCosh(c)
        | MetricConfig::Exp(c)
        | MetricConfig::Huber(c)
        | MetricConfig::Msac(c)
        | MetricConfig::Magsac(c)
        | MetricConfig::SacIa(c) => &mut c.threshold,
        MetricConfig::Quantile(c) | MetricConfig::NegQuantile(c) => &mut c.threshold,
        MetricConfig::PointDistance(c) => &mut c.threshold,
        MetricConfig::OverlappedPoints(c) | MetricConfig::SoftOverlap(c) => &mut c.threshold,
    };
    *place = Length::Resolutions(threshold_pr);
    metric
}

/// The same estimator with another budget, where it has one.
pub(crate) fn with_iterations(estimator: &EstimatorConfig, iterations: u64) -> EstimatorConfig {
    let mut estimator = estimator.clone();
    match &mut estimator {
        EstimatorConfig::Ransac(c) => c.iterations = iterations,
        EstimatorConfig::TwoPoint(c) => c.iterations = iterations,
        EstimatorConfig::OnePoint(c) => c.iterations = iterations,
        EstimatorConfig::SacIa(c) => c.iterations = iterations,
        EstimatorConfig::Pivots(_) | EstimatorConfig::Seeds(_) | EstimatorConfig::Cliques(_) => {}
    }
    estimator
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_plan_does_not_mean_is_said() {
        let said = |text: &str| toml::from_str::<Plan>(&format!("title = 't'\n{text}")).unwrap().contradiction();
        assert_eq!(said("metrics = [{ mse = {} }, { inlier-count = {} }]\nbaseline = 'INLIER'"), None);
        assert_eq!(said("estimators = [{ ransac = {} }, { ransac = { min-spread = '15pr' } }]"), None);
        for (text, expected) in [
            ("metrics = [{ mse = { threshold = '1pr' } }]", "threshold of MSE"),
            ("estimators = [{ ransac = { iterations = 50 } }]", "iterations of RANSAC"),
            ("metrics = [{ mse = {} }, { mse = {} }]", "MSE is listed twice"),
            ("metrics = [{ mse = {} }]\nbaseline = 'INLIER'", "the baseline `INLIER`"),
        ] {
            assert!(said(text).is_some_and(|said| said.contains(expected)), "{text}");
        }
    }
}
