//! User settings for the metric.

use crate::{Clouds, Density, Kernel, Metric, NearestSum, PointDistance, Reading, Summed};
use crate::{Exp, Huber, InlierCount, LogCosh, Mae, Magsac, Msac, Mse, Quantile, QuantileOutliers, TruncatedError};
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
    /// `(1 − u)²`: the default, clearly the best if wrong matches agree among themselves.
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
    /// `1 − u²`.
    Msac(ThresholdConfig),
    /// MAGSAC++: like EXP, but falling to zero at the threshold.
    Magsac(ThresholdConfig),
    /// Truncated error, `−min(u, 1)`: ranks poses as MAE does.
    SacIa(ThresholdConfig),
    /// Mean distance of the source points to the target (PC Dist).
    PointDistance(PointDistanceConfig),
    /// Number of source points with a target point nearby (#OP).
    OverlappedPoints(OverlapConfig),
    /// Like `OverlappedPoints`, each point counting `(1 − u)²`.
    SoftOverlap(OverlapConfig),
}

/// Settings of most metrics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct ThresholdConfig {
    /// Residuals below this are inliers (the paper's `t`).
    pub threshold: Length,
}

/// Settings of `[metric.quantile]` and `[metric.neg-quantile]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct QuantileConfig {
    /// Residuals below this are inliers (the paper's `t`).
    pub threshold: Length,
    /// Weight of inliers relative to outliers, between 0 and 1 (the paper: 0.9).
    #[serde(deserialize_with = "congruent_geometry::numbers::probability")]
    pub m: f64,
}

/// Settings of `[metric.overlapped-points]` and `[metric.soft-overlap]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct OverlapConfig {
    /// Source points closer than this to the target overlap.
    pub threshold: Length,
    /// Which points are used.
    pub clouds: Density,
}

/// Settings of `[metric.point-distance]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PointDistanceConfig {
    /// Source points closer than this to the target count; the literal reading ignores it.
    pub threshold: Length,
    /// Whether to follow the authors' program or the paper's text.
    pub reading: Reading,
    /// Which points are used.
    pub clouds: Density,
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

impl Default for OverlapConfig {
    fn default() -> Self {
        OverlapConfig { threshold: PAPER_THRESHOLD, clouds: Density::default() }
    }
}

impl Default for PointDistanceConfig {
    fn default() -> Self {
        PointDistanceConfig { threshold: PAPER_THRESHOLD, reading: Reading::default(), clouds: Density::default() }
    }
}

impl Default for MetricConfig {
    fn default() -> Self {
        MetricConfig::Mse(ThresholdConfig::default())
    }
}

impl MetricConfig {
    /// Returns whether the metric measures the clouds rather than the correspondences.
    #[must_use]
    pub fn needs_clouds(&self) -> bool {
        match self {
            MetricConfig::PointDistance(_) | MetricConfig::OverlappedPoints(_) | MetricConfig::SoftOverlap(_) => true,
            MetricConfig::InlierCount(_)
            | MetricConfig::Mae(_)
            | MetricConfig::Mse(_)
            | MetricConfig::LogCosh(_)
            | MetricConfig::Exp(_)
            | MetricConfig::Quantile(_)
            | MetricConfig::NegQuantile(_)
            | MetricConfig::Huber(_)
            | MetricConfig::Msac(_)
            | MetricConfig::Magsac(_)
            | MetricConfig::SacIa(_) => false,
        }
    }

    /// Builds the metric that these settings describe, for `clouds` of this resolution. Metrics over correspondences
    /// ignore the clouds.
    #[must_use]
    pub fn build<'a>(&self, resolution: f64, clouds: Clouds<'a>) -> Box<dyn Metric + 'a> {
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
            MetricConfig::Msac(c) => Box::new(Summed(Msac::new(of(c)))),
            MetricConfig::Magsac(c) => Box::new(Summed(Magsac::new(of(c)))),
            MetricConfig::SacIa(c) => Box::new(Summed(TruncatedError::new(of(c)))),
            MetricConfig::PointDistance(c) => c.build(resolution, clouds),
            MetricConfig::OverlappedPoints(c) => c.build(InlierCount::new, resolution, clouds),
            MetricConfig::SoftOverlap(c) => c.build(Mse::new, resolution, clouds),
        }
    }
}

impl QuantileConfig {
    fn build<'a>(&self, resolution: f64, outliers: QuantileOutliers) -> Box<dyn Metric + 'a> {
        Box::new(Summed(Quantile::new(self.threshold.resolve(resolution), self.m, outliers)))
    }
}

impl OverlapConfig {
    fn build<'a, K: Kernel + 'a>(
        &self,
        kernel: fn(f64) -> K,
        resolution: f64,
        clouds: Clouds<'a>,
    ) -> Box<dyn Metric + 'a> {
        let threshold = self.threshold.resolve(resolution);
        Box::new(NearestSum::new(kernel(threshold), clouds, self.clouds, resolution, threshold))
    }
}

impl PointDistanceConfig {
    fn build<'a>(&self, resolution: f64, clouds: Clouds<'a>) -> Box<dyn Metric + 'a> {
        let threshold = self.threshold.resolve(resolution);
        Box::new(PointDistance::new(threshold, self.reading, clouds, self.clouds, resolution))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn over_correspondences(threshold: Length) -> Vec<MetricConfig> {
        let plain = || ThresholdConfig { threshold };
        let quantile = || QuantileConfig { threshold, m: 0.9 };
        vec![
            MetricConfig::InlierCount(plain()),
            MetricConfig::Mae(plain()),
            MetricConfig::Mse(plain()),
            MetricConfig::LogCosh(plain()),
            MetricConfig::Exp(plain()),
            MetricConfig::Quantile(quantile()),
            MetricConfig::NegQuantile(quantile()),
            MetricConfig::Huber(plain()),
            MetricConfig::Msac(plain()),
            MetricConfig::Magsac(plain()),
            MetricConfig::SacIa(plain()),
        ]
    }

    /// Every metric over correspondences at one threshold.
    pub(crate) fn one_of_each(threshold: f64, resolution: f64) -> Vec<Box<dyn Metric>> {
        use crate::clouds::tests::surface;
        let none: &'static congruent_geometry::Surface = Box::leak(Box::new(surface(vec![])));
        let clouds = Clouds { source: none, target: none };
        over_correspondences(Length::Units(threshold)).iter().map(|config| config.build(resolution, clouds)).collect()
    }

    #[test]
    fn configurations_survive_the_round_trip() {
        let mut all = over_correspondences(Length::Resolutions(3.0));
        all.push(MetricConfig::PointDistance(PointDistanceConfig::default()));
        all.push(MetricConfig::OverlappedPoints(OverlapConfig::default()));
        all.push(MetricConfig::SoftOverlap(OverlapConfig::default()));
        for config in all {
            let text = toml::to_string(&config).unwrap();
            assert_eq!(toml::from_str::<MetricConfig>(&text).unwrap(), config, "{text}");
        }
        let text = "[point-distance]\nreading = \"literal\"\nclouds = \"full\"";
        let expected =
            PointDistanceConfig { reading: Reading::Literal, clouds: Density::Full, ..PointDistanceConfig::default() };
        assert_eq!(toml::from_str::<MetricConfig>(text).unwrap(), MetricConfig::PointDistance(expected));
        assert!(toml::from_str::<MetricConfig>("[mse]\nclouds = \"full\"").is_err());
    }
}
