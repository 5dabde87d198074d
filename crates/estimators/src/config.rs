//! User settings for the estimator.

mod graph;

pub use graph::{CliquesConfig, GraphConfig, PivotsConfig, SeedsConfig};

use crate::{AdaptiveStop, HypothesisGenerator, Order, PairRule, TripleRule};
use crate::{OnePoint, SacIa, ThreePoint, TwoPoint};
use congruent_geometry::Length;
use congruent_metrics::Evidence;
use serde::{Deserialize, Serialize};

/// The choice of an estimator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorConfig {
    /// Three random correspondences per trial.
    Ransac(RansacConfig),
    /// Two correspondences that preserve their distance and the angle of their axes; needs frames.
    TwoPoint(TwoPointConfig),
    /// One correspondence and its frames; needs frames.
    OnePoint(OnePointConfig),
    /// Three correspondences far apart.
    SacIa(SacIaConfig),
    /// Triangles of the compatibility graph, the best connected first.
    Pivots(PivotsConfig),
    /// Groups of the compatibility graph around the most reliable correspondences.
    Seeds(SeedsConfig),
    /// Maximal cliques of the compatibility graph.
    Cliques(CliquesConfig),
}

/// Settings of `[estimator.ransac]`. Everything except the number of trials is off by default, as in the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct RansacConfig {
    /// Number of trials; the paper sweeps 200 to 2000.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// Minimum similarity of corresponding edges of a sample, shorter over longer (usually 0.9).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "congruent_geometry::numbers::optional_probability")]
    pub edge_similarity: Option<f64>,
    /// Distance that the points of a sample must exceed in the source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_spread: Option<Length>,
    /// The order in which samples are drawn.
    pub order: Order,
    /// Stops as soon as a sample consisting only of inliers has very likely been drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive_stop: Option<AdaptiveStopConfig>,
}

/// Settings of `[estimator.ransac.adaptive-stop]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct AdaptiveStopConfig {
    /// Required probability of that; below one, which no number of trials reaches.
    #[serde(deserialize_with = "congruent_geometry::numbers::below_one")]
    pub confidence: f64,
    /// Residuals below this are inliers.
    pub threshold: Length,
}

/// Settings of `[estimator.two-point]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct TwoPointConfig {
    /// Number of trials; rejected samples do not count.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// Maximum difference of the distance between the two points in the two scans.
    pub length_tolerance: Length,
    /// Whether the angles of the axes are compared.
    pub angle_test: AngleTest,
    /// Maximum difference of the angle between the two axes in the two scans, degrees.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle_deg: f64,
}

/// Whether 2SAC-GC compares angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleTest {
    /// As in its paper.
    #[default]
    On,
    /// As in the authors' program, which compares radians with a limit in degrees and thus rejects nothing.
    Off,
}

/// Settings of `[estimator.one-point]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct OnePointConfig {
    /// Maximum number of trials; if there are no more correspondences than that, each is tried once.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// Minimum margin of the axes of both frames: 0 admits every frame, as in the paper; below some 0.1 the sign or the
    /// direction of an axis is often decided by noise.
    #[serde(deserialize_with = "congruent_geometry::numbers::probability")]
    pub min_margin: f64,
}

/// Settings of `[estimator.sac-ia]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SacIaConfig {
    /// Number of trials.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// Minimum distance between the points of a sample in the source; halved where it cannot be kept.
    pub min_distance: Length,
}

/// Number of trials of every estimator that does not determine it by itself; within the paper's sweep.
const ITERATIONS: u64 = 1000;

impl Default for RansacConfig {
    fn default() -> Self {
        RansacConfig {
            iterations: ITERATIONS,
            edge_similarity: None,
            min_spread: None,
            order: Order::default(),
            adaptive_stop: None,
        }
    }
}

impl Default for AdaptiveStopConfig {
    fn default() -> Self {
        AdaptiveStopConfig { confidence: 0.999, threshold: Length::Resolutions(7.5) }
    }
}

impl Default for TwoPointConfig {
    fn default() -> Self {
        TwoPointConfig {
            iterations: ITERATIONS,
            length_tolerance: Length::Resolutions(7.5),
            angle_test: AngleTest::default(),
            max_angle_deg: 15.0,
        }
    }
}

impl Default for OnePointConfig {
    fn default() -> Self {
        OnePointConfig { iterations: ITERATIONS, min_margin: 0.0 }
    }
}

impl Default for SacIaConfig {
    fn default() -> Self {
        SacIaConfig { iterations: ITERATIONS, min_distance: Length::Resolutions(15.0) }
    }
}

impl Default for EstimatorConfig {
    fn default() -> Self {
        EstimatorConfig::Ransac(RansacConfig::default())
    }
}

impl EstimatorConfig {
    /// Builds the generator that these settings describe, for clouds of this resolution.
    #[must_use]
    pub fn build<'a>(&self, evidence: &'a Evidence, resolution: f64, seed: u64) -> Box<dyn HypothesisGenerator + 'a> {
        match self {
            EstimatorConfig::Ransac(c) => {
                Box::new(ThreePoint::with_rule(evidence, c.rule(resolution), c.iterations, seed))
            }
            EstimatorConfig::TwoPoint(c) => Box::new(TwoPoint::new(evidence, c.rule(resolution), c.iterations, seed)),
            EstimatorConfig::OnePoint(c) => Box::new(OnePoint::new(evidence, c.iterations, seed)),
            EstimatorConfig::SacIa(c) => {
                Box::new(SacIa::new(evidence, c.min_distance.resolve(resolution), c.iterations, seed))
            }
            EstimatorConfig::Pivots(c) => Box::new(c.build(evidence, resolution)),
            EstimatorConfig::Seeds(c) => Box::new(c.build(evidence, resolution)),
            EstimatorConfig::Cliques(c) => Box::new(c.build(evidence, resolution)),
        }
    }

    /// Returns whether the evidence must come with local reference frames; without them nothing is proposed.
    #[must_use]
    pub fn needs_frames(&self) -> bool {
        match self {
            EstimatorConfig::TwoPoint(_) | EstimatorConfig::OnePoint(_) => true,
            EstimatorConfig::Ransac(_)
            | EstimatorConfig::SacIa(_)
            | EstimatorConfig::Pivots(_)
            | EstimatorConfig::Seeds(_)
            | EstimatorConfig::Cliques(_) => false,
        }
    }

    /// Returns the minimum margin of the local reference frames in the evidence, from 0 (arbitrary axes) to 1.
    #[must_use]
    pub fn min_frame_margin(&self) -> f64 {
        match self {
            EstimatorConfig::OnePoint(c) => c.min_margin,
            _ => 0.0,
        }
    }
}

impl RansacConfig {
    fn rule(&self, resolution: f64) -> TripleRule {
        TripleRule {
            min_edge_ratio: self.edge_similarity.unwrap_or(0.0),
            min_spread: self.min_spread.map_or(0.0, |length| length.resolve(resolution)),
            order: self.order,
            stop: self
                .adaptive_stop
                .as_ref()
                .map(|c| AdaptiveStop::new(c.confidence, c.threshold.resolve(resolution), 3)),
        }
    }
}

impl TwoPointConfig {
    fn rule(&self, resolution: f64) -> PairRule {
        let max_angle = match self.angle_test {
            AngleTest::On => self.max_angle_deg.to_radians(),
            AngleTest::Off => std::f64::consts::PI,
        };
        PairRule { length_tolerance: self.length_tolerance.resolve(resolution), max_angle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certainty_cannot_be_asked_for() {
        let stop = |confidence| toml::from_str::<AdaptiveStopConfig>(&format!("confidence = {confidence}"));
        assert!(stop("0.0").is_ok() && stop("0.999999").is_ok());
        assert!(stop("1.0").is_err() && stop("-0.1").is_err() && stop("nan").is_err());
    }

    #[test]
    fn configurations_survive_the_round_trip() {
        let choosy = RansacConfig {
            edge_similarity: Some(0.9),
            min_spread: Some(Length::Resolutions(15.0)),
            order: Order::Prosac,
            adaptive_stop: Some(AdaptiveStopConfig::default()),
            ..RansacConfig::default()
        };
        let pruned = GraphConfig { pruning: crate::Pruning::Core, ..GraphConfig::default() };
        for config in [
            EstimatorConfig::default(),
            EstimatorConfig::Ransac(choosy.clone()),
            EstimatorConfig::TwoPoint(TwoPointConfig { angle_test: AngleTest::Off, ..TwoPointConfig::default() }),
            EstimatorConfig::OnePoint(OnePointConfig::default()),
            EstimatorConfig::SacIa(SacIaConfig::default()),
            EstimatorConfig::Pivots(PivotsConfig { graph: pruned, ..PivotsConfig::default() }),
            EstimatorConfig::Seeds(SeedsConfig::default()),
            EstimatorConfig::Cliques(CliquesConfig::default()),
        ] {
            let text = toml::to_string(&config).unwrap();
            assert_eq!(toml::from_str::<EstimatorConfig>(&text).unwrap(), config, "{text}");
        }
        let text = "[ransac]\nedge-similarity = 0.9\nmin-spread = \"15pr\"\norder = \"prosac\"\n[ransac.adaptive-stop]";
        assert_eq!(toml::from_str::<EstimatorConfig>(text).unwrap(), EstimatorConfig::Ransac(choosy));
    }
}
