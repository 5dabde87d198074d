//! What an experiment varies.

use super::Nuisance;
use super::labels::{estimator_label, metric_label, unusual};
use congruent_estimators::EstimatorConfig;
use congruent_geometry::{Length, numbers};
use congruent_metrics::MetricConfig;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// One table or figure. Every combination of the values in the lists is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Plan {
    /// Title of the result.
    pub title: String,
    /// How gaps in the paper were filled; printed with the result.
    #[serde(default)]
    pub notes: Vec<String>,
    /// What is measured.
    #[serde(default)]
    pub shows: Shows,
    /// What the rows of the table are …
    #[serde(default = "rows")]
    pub rows: Axis,
    /// … and its columns. For each combination of all else that varies there is one table.
    #[serde(default = "columns")]
    pub columns: Axis,
    /// Changes to the chain before the estimator.
    #[serde(default = "unchanged")]
    pub variants: Vec<Variant>,
    /// Nuisances on the target.
    #[serde(default = "unspoilt")]
    pub nuisances: Vec<Nuisance>,
    /// Estimators, each of which proposes its own stream of poses.
    #[serde(default = "plain")]
    pub estimators: Vec<EstimatorConfig>,
    /// Metrics, all of which rank the same stream.
    #[serde(default)]
    pub metrics: Vec<MetricConfig>,
    /// Thresholds of all metrics, in `pr` of the chain.
    #[serde(default = "paper_threshold", deserialize_with = "numbers::all_positive")]
    pub thresholds_pr: Vec<f64>,
    /// Numbers of trials, from the beginning of the stream, among which the best pose is chosen.
    #[serde(default = "paper_iterations")]
    pub iterations: Vec<u64>,
    /// Bounds at which a pose counts as right, in `pr` of `measured-on`.
    #[serde(default = "paper_bound", deserialize_with = "numbers::all_positive")]
    pub d_rmse: Vec<f64>,
    /// The points on which errors are measured; their resolution is the `pr` of the errors.
    #[serde(default)]
    pub measured_on: MeasuredOn,
    /// Name of a metric with which every other one is compared by McNemar's exact test.
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
    /// How many matches are true, and which fraction of them; nothing is proposed.
    Inliers,
    /// How long a metric takes for one pose; nothing is ranked.
    Time,
}

/// A change to the configuration, in the form that `--set` takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Variant {
    /// Name of the variant in tables.
    pub name: String,
    /// Settings as `key=value`, applied in order.
    pub set: Vec<String>,
}

/// The points on which errors are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasuredOn {
    /// The scans as provided, as in `congruent evaluate`.
    #[default]
    Scans,
    /// The sampled clouds, as in the work of the paper's authors; their `pr` is larger.
    Sampled,
}

/// A quantity that varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// The data set.
    Dataset,
    /// The variant of the chain.
    Variant,
    /// The nuisance on the target.
    Nuisance,
    /// The estimator.
    Estimator,
    /// The metric.
    Metric,
    /// The inlier threshold, `pr`.
    Threshold,
    /// The number of trials that count.
    Iterations,
    /// The bound below which a pose is right, `pr`.
    DRmse,
}

impl Axis {
    /// All axes.
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

    /// Returns the name of the axis in tables.
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
    /// Returns what is wrong with the plan: a value or a name listed twice, a setting without effect, or a baseline that is not
    /// among the metrics; `None` for a plan that can be run.
    #[must_use]
    pub fn contradiction(&self) -> Option<String> {
        let metrics: Vec<Cow<'_, str>> = self.metrics.iter().map(metric_label).collect();
        let estimators: Vec<Cow<'_, str>> = self.estimators.iter().map(estimator_label).collect();
        let threshold = self.metrics.iter().position(|metric| unusual(metric).contains_key("threshold"));
        let iterations = self.estimators.iter().position(|estimator| unusual(estimator).contains_key("iterations"));
        let baseline = self.baseline.as_ref().filter(|baseline| !metrics.iter().any(|metric| metric == *baseline));
        if let Some(at) = threshold {
            Some(format!("the threshold of {} has no effect; write `thresholds-pr`, for all metrics", metrics[at]))
        } else if let Some(at) = iterations {
            Some(format!("the iterations of {} have no effect; write `iterations`, for all estimators", estimators[at]))
        } else if let Some((list, value)) = self.repetition() {
            Some(format!("{value} is listed twice in `{list}`, and results are told apart by it; change or remove one"))
        } else {
            baseline.map(|name| format!("the baseline `{name}` is not one of its metrics: {}", metrics.join(", ")))
        }
    }

    /// Returns the first value that a list has twice, as it is shown in tables, after the name of the list.
    fn repetition(&self) -> Option<(&'static str, String)> {
        let lists = [
            ("variants", texts(&self.variants, |variant| variant.name.clone())),
            ("nuisances", texts(&self.nuisances, Nuisance::to_string)),
            ("estimators", texts(&self.estimators, |estimator| estimator_label(estimator).into_owned())),
            ("metrics", texts(&self.metrics, |metric| metric_label(metric).into_owned())),
            ("thresholds-pr", texts(&self.thresholds_pr, f64::to_string)),
            ("iterations", texts(&self.iterations, u64::to_string)),
            ("d-rmse", texts(&self.d_rmse, f64::to_string)),
        ];
        lists.into_iter().find_map(|(list, values)| {
            let again = (1..values.len()).find(|&at| values[..at].contains(&values[at]))?;
            Some((list, values[again].clone()))
        })
    }
}

fn texts<T>(values: &[T], text: impl Fn(&T) -> String) -> Vec<String> {
    values.iter().map(text).collect()
}

/// Returns the same metric with another threshold.
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

/// Returns the same estimator with another number of iterations, if it has that setting.
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
        assert_eq!(said("nuisances = [{ keep-randomly = 0.005 }, { keep-randomly = 0.001 }]"), None);
        for (text, expected) in [
            ("metrics = [{ mse = { threshold = '1pr' } }]", "threshold of MSE"),
            ("estimators = [{ ransac = { iterations = 50 } }]", "iterations of RANSAC"),
            ("metrics = [{ mse = {} }, { mse = {} }]", "MSE is listed twice in `metrics`"),
            ("estimators = [{ ransac = {} }, { ransac = {} }]", "RANSAC is listed twice in `estimators`"),
            (
                "variants = [{ name = 'a', set = [] }, { name = 'a', set = ['seed=1'] }]",
                "a is listed twice in `variants`",
            ),
            ("nuisances = [{ noise = 1.0 }, { noise = 1 }]", "noise 1 pr is listed twice in `nuisances`"),
            ("thresholds-pr = [7.5, 5, 7.5]", "7.5 is listed twice in `thresholds-pr`"),
            ("iterations = [10, 10]", "10 is listed twice in `iterations`"),
            ("d-rmse = [1.0, 1]", "1 is listed twice in `d-rmse`"),
            ("metrics = [{ mse = {} }]\nbaseline = 'INLIER'", "the baseline `INLIER`"),
        ] {
            assert!(said(text).is_some_and(|said| said.contains(expected)), "{text}");
        }
    }
}
