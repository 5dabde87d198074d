//! What a user may say about the metric.

use crate::{Exp, Huber, InlierCount, LogCosh, Mae, Metric, Mse, Quantile, QuantileOutliers, Summed};
use congruent_geometry::Length;
use serde::{Deserialize, Serialize};

/// The choice of a metric. Each has its inlier threshold `t`, by default the paper's 7.5 pr.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MetricConfig {
    /// Number of inliers.
    InlierCount(ThresholdConfig),
    /// `1 − u`.
    Mae(ThresholdConfig),
    /// `(1 − u)²`: the default, clearly the best where wrong matches agree among themselves.
    Mse(ThresholdConfig),
    /// `ln cosh(t − e) / ln cosh t`.
    LogCosh(ThresholdConfig),
    /// `exp(−u²/2)`.
    Exp(ThresholdConfig),
    /// Inliers `m(1 − u)`, outliers `+(1 − m)(1 − 1/u)`.
    Quantile(QuantileConfig),
    /// Inliers `m(1 − u)`, outliers `−(1 − m)(1 − 1/u)`.
    NegQuantile(QuantileConfig),
    /// Huber penalty, not truncated; `threshold` is its δ.
    Huber(ThresholdConfig),
}

/// Settings of most metrics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct ThresholdConfig {
    /// Residuals below it are inliers (the paper's `t`).
    pub threshold: Length,
}

/// Settings of `[metric.quantile]` and `[metric.neg-quantile]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct QuantileConfig {
    /// Residuals below it are inliers (the paper's `t`).
    pub threshold: Length,
    /// Weight of inliers against outliers, between 0 and 1 (the paper: 0.9).
    pub m: f64,
}

const PAPER_THRESHOLD: Length = Length::Resolutions(7.5);

impl Default for ThresholdConfig {
    fn default() -> Self {
        ThresholdConfig { threshold: PAPER_THRESHOLD }
    }
}

impl Default for QuantileConfig {
    fn default() -> Self {
        QuantileConfig { threshold: PAPER_THRESHOLD, m: 0.9 }
    }
}

impl Default for MetricConfig {
    fn default() -> Self {
        MetricConfig::Mse(ThresholdConfig::default())
    }
}

impl MetricConfig {
    /// The metric that these settings describe, for clouds of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Box<dyn Metric> {
        let of = |c: &ThresholdConfig| c.threshold.resolve(resolution);
        match self {
            MetricConfig::InlierCount(c) => Box::new(Summed(InlierCount::new(of(c)))),
            MetricConfig::Mae(c) => Box::new(Summed(Mae::new(of(c)))),
            MetricConfig::Mse(c) => Box::new(Summed(Mse::new(of(c)))),
            MetricConfig::LogCosh(c) => Box::new(Summed(LogCosh::new(of(c), resolution))),
            MetricConfig::Exp(c) => Box::new(Summed(Exp::new(of(c)))),
            MetricConfig::Quantile(c) => c.build(resolution, QuantileOutliers::Add),
            MetricConfig::NegQuantile(c) => c.build(resolution, QuantileOutliers::Subtract),
            MetricConfig::Huber(c) => Box::new(Summed(Huber::new(of(c)))),
        }
    }
}

impl QuantileConfig {
    fn build(&self, resolution: f64, outliers: QuantileOutliers) -> Box<dyn Metric> {
        Box::new(Summed(Quantile::new(self.threshold.resolve(resolution), self.m, outliers)))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Every member of the family at one threshold.
    pub(crate) fn one_of_each(threshold: f64, resolution: f64) -> Vec<Box<dyn Metric>> {
        let plain = || ThresholdConfig { threshold: Length::Units(threshold) };
        let quantile = || QuantileConfig { threshold: Length::Units(threshold), m: 0.9 };
        [
            MetricConfig::InlierCount(plain()),
            MetricConfig::Mae(plain()),
            MetricConfig::Mse(plain()),
            MetricConfig::LogCosh(plain()),
            MetricConfig::Exp(plain()),
            MetricConfig::Quantile(quantile()),
            MetricConfig::NegQuantile(quantile()),
            MetricConfig::Huber(plain()),
        ]
        .iter()
        .map(|config| config.build(resolution))
        .collect()
    }
}
