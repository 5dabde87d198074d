//! What a user may say about the estimator.

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
    /// Three random correspondences a trial.
    Ransac(RansacConfig),
    /// Two correspondences that keep their distance and the angle of their axes; needs frames.
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

/// Settings of `[estimator.ransac]`. All but the number of trials is off by default, as in the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct RansacConfig {
    /// Trials; the paper sweeps 200 to 2000.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// Corresponding edges of a sample are at least this similar, shorter over longer (usually 0.9).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "congruent_geometry::numbers::optional_probability")]
    pub edge_similarity: Option<f64>,
    /// The points of a sample are farther apart than this in the source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_spread: Option<Length>,
    /// Which samples come first.
    pub order: Order,
    /// Stop as soon as a sample of inliers alone has very likely been drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive_stop: Option<AdaptiveStopConfig>,
}

/// Settings of `[estimator.ransac.adaptive-stop]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct AdaptiveStopConfig {
    /// How likely it must be, below one.
    #[serde(deserialize_with = "congruent_geometry::numbers::probability")]
    pub confidence: f64,
    /// Residuals below it are inliers.
    pub threshold: Length,
}

/// Settings of `[estimator.two-point]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct TwoPointConfig {
    /// Trials; rejected samples do not count.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// The distance between the two points may differ by this much between the scans.
    pub length_tolerance: Length,
    /// Whether the angles of the axes are compared.
    pub angle_test: AngleTest,
    /// The angle between the two axes may differ by this much between the scans, degrees.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle_deg: f64,
}

/// Whether 2SAC-GC compares angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleTest {
    /// As its paper says.
    #[default]
    On,
    /// As the authors' program works, which compares radians with a limit in degrees and so rejects nothing.
    Off,
}

/// Settings of `[estimator.one-point]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct OnePointConfig {
    /// Trials at most; with no fewer than correspondences, each is tried once.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
}

/// Settings of `[estimator.sac-ia]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SacIaConfig {
    /// Trials.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub iterations: u64,
    /// The points of a sample are at least this far apart in the source; halved where that cannot be had.
    pub min_distance: Length,
}

/// Trials of every estimator that does not know by itself how many it needs; within the paper's sweep.
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
        OnePointConfig { iterations: ITERATIONS }
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
    /// The generator that these settings describe, for clouds of this resolution.
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

    /// Whether the evidence must come with reference frames; without them nothing is proposed.
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
