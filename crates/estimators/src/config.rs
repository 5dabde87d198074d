//! What a user may say about the estimator.

use crate::{Compatibility, HypothesisGenerator, Pivots, ThreePoint};
use congruent_geometry::Length;
use congruent_metrics::Evidence;
use serde::{Deserialize, Serialize};

/// The choice of an estimator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorConfig {
    /// Three random correspondences a trial.
    Ransac(RansacConfig),
    /// Triangles of the compatibility graph, the best connected first.
    Pivots(PivotsConfig),
}

/// Settings of `[estimator.ransac]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct RansacConfig {
    /// Trials; the paper sweeps 200 to 2000.
    pub iterations: u64,
}

/// Settings of `[estimator.pivots]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PivotsConfig {
    /// Distances in the two scans may differ by this much.
    pub tolerance: Length,
    /// Correspondences closer than this are not compared.
    pub min_distance: Length,
    /// The angle between two normals may differ by this much, radians.
    pub max_angle: f64,
    /// The cosine between a normal and the line to the other point may differ by this much.
    pub max_cosine: f64,
    /// At most this many pivots; each proposes two poses.
    pub pivots: usize,
}

impl Default for PivotsConfig {
    fn default() -> Self {
        PivotsConfig {
            tolerance: Length::Resolutions(4.0),
            min_distance: Length::Resolutions(8.0),
            max_angle: 0.45,
            max_cosine: 0.4,
            pivots: 8000,
        }
    }
}

impl Default for RansacConfig {
    fn default() -> Self {
        RansacConfig { iterations: 1000 }
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
            EstimatorConfig::Ransac(c) => Box::new(ThreePoint::new(evidence, c.iterations, seed)),
            EstimatorConfig::Pivots(c) => Box::new(Pivots::new(evidence, &c.compatibility(resolution), c.pivots)),
        }
    }
}

impl PivotsConfig {
    fn compatibility(&self, resolution: f64) -> Compatibility {
        Compatibility {
            tolerance: self.tolerance.resolve(resolution),
            min_distance: self.min_distance.resolve(resolution),
            max_angle: self.max_angle,
            max_cosine: self.max_cosine,
        }
    }
}
