//! What a user may say about the estimators that work on the compatibility graph.

use crate::{Cliques, Compatibility, Graph, Pivots, Pruning, SeedRule, Seeds};
use congruent_geometry::Length;
use congruent_metrics::Evidence;
use serde::{Deserialize, Serialize};

/// Settings of `[estimator.pivots]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PivotsConfig {
    /// Distances in the two scans may differ by this much.
    pub tolerance: Length,
    /// Correspondences closer than this are not compared.
    pub min_distance: Length,
    /// The angle between two normals may differ by this much, radians.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle: f64,
    /// The cosine between a normal and the line to the other point may differ by this much.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_cosine: f64,
    /// What is taken off the graph first.
    pub pruning: Pruning,
    /// At most this many pivots; each proposes two poses.
    pub pivots: usize,
}

/// Settings of `[estimator.seeds]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SeedsConfig {
    /// Distances in the two scans may differ by this much; shared neighbours are counted with half of it.
    pub tolerance: Length,
    /// Correspondences closer than this are not compared.
    pub min_distance: Length,
    /// The angle between two normals may differ by this much, radians.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle: f64,
    /// The cosine between a normal and the line to the other point may differ by this much.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_cosine: f64,
    /// What is taken off the graph first.
    pub pruning: Pruning,
    /// The source points of two seeds are farther apart than this.
    pub separation: Length,
    /// Seeds as a share of the correspondences, at most; each proposes one pose.
    #[serde(deserialize_with = "congruent_geometry::numbers::share")]
    pub share: f64,
    /// Correspondences that a seed gathers, itself included.
    pub gathered: usize,
    /// How many of those are fitted.
    pub kept: usize,
}

/// Settings of `[estimator.cliques]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct CliquesConfig {
    /// Distances in the two scans may differ by this much.
    pub tolerance: Length,
    /// Correspondences closer than this are not compared.
    pub min_distance: Length,
    /// The angle between two normals may differ by this much, radians.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle: f64,
    /// The cosine between a normal and the line to the other point may differ by this much.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_cosine: f64,
    /// What is taken off the graph first.
    pub pruning: Pruning,
    /// Branches of the search that are followed to their end, for each correspondence.
    pub branches: usize,
}

const TOLERANCE: Length = Length::Resolutions(4.0);
const MIN_DISTANCE: Length = Length::Resolutions(8.0);
const MAX_ANGLE: f64 = 0.45;
const MAX_COSINE: f64 = 0.4;

impl Default for PivotsConfig {
    fn default() -> Self {
        PivotsConfig {
            tolerance: TOLERANCE,
            min_distance: MIN_DISTANCE,
            max_angle: MAX_ANGLE,
            max_cosine: MAX_COSINE,
            pruning: Pruning::default(),
            pivots: 8000,
        }
    }
}

impl Default for SeedsConfig {
    /// Numbers of the authors for FPFH-like descriptors; they separate seeds by the tolerance.
    fn default() -> Self {
        SeedsConfig {
            tolerance: TOLERANCE,
            min_distance: MIN_DISTANCE,
            max_angle: MAX_ANGLE,
            max_cosine: MAX_COSINE,
            pruning: Pruning::default(),
            separation: TOLERANCE,
            share: 0.2,
            gathered: 30,
            kept: 20,
        }
    }
}

impl Default for CliquesConfig {
    fn default() -> Self {
        CliquesConfig {
            tolerance: TOLERANCE,
            min_distance: MIN_DISTANCE,
            max_angle: MAX_ANGLE,
            max_cosine: MAX_COSINE,
            pruning: Pruning::default(),
            branches: 10,
        }
    }
}

impl PivotsConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Pivots<'a> {
        let rule = compatibility(self.tolerance, self.min_distance, self.max_angle, self.max_cosine, resolution);
        Pivots::new(evidence, &Graph::new(evidence, &rule).pruned(self.pruning), self.pivots)
    }
}

impl SeedsConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Seeds<'a> {
        let rule = compatibility(self.tolerance, self.min_distance, self.max_angle, self.max_cosine, resolution);
        let seeds = SeedRule {
            tolerance: rule.tolerance,
            separation: self.separation.resolve(resolution),
            share: self.share,
            gathered: self.gathered,
            kept: self.kept,
        };
        Seeds::new(evidence, Graph::new(evidence, &rule).pruned(self.pruning), seeds)
    }
}

impl CliquesConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Cliques<'a> {
        let rule = compatibility(self.tolerance, self.min_distance, self.max_angle, self.max_cosine, resolution);
        Cliques::new(evidence, &Graph::new(evidence, &rule).pruned(self.pruning), self.branches)
    }
}

fn compatibility(
    tolerance: Length,
    min_distance: Length,
    max_angle: f64,
    max_cosine: f64,
    resolution: f64,
) -> Compatibility {
    Compatibility {
        tolerance: tolerance.resolve(resolution),
        min_distance: min_distance.resolve(resolution),
        max_angle,
        max_cosine,
    }
}
