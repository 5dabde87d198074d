//! Everything a user may say about the chain. The defaults live here, and in the families' own configs.

use congruent_descriptors::DescriptorConfig;
use congruent_estimators::EstimatorConfig;
use congruent_geometry::{Length, Orientation};
use congruent_keypoints::{DetectorConfig, HarrisConfig, SupportFilter};
use congruent_matching::MatcherConfig;
use congruent_metrics::MetricConfig;
use serde::{Deserialize, Serialize};

/// The whole chain. Lengths in `pr` are multiples of the mean resolution of the two clouds that the stage works on:
/// the scans as they came for `sampling`, the sampled clouds for all the rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PipelineConfig {
    /// Of all random draws.
    pub seed: u64,
    /// Thinning of the scans before anything else.
    pub sampling: SamplingConfig,
    /// Surface normals for descriptors.
    pub normals: NormalsConfig,
    /// Where to describe.
    pub detector: DetectorConfig,
    /// Which keypoints have surroundings worth describing.
    pub support: SupportFilter,
    /// How to describe.
    pub descriptor: DescriptorConfig,
    /// How to match.
    pub matcher: MatcherConfig,
    /// How to propose poses.
    pub estimator: EstimatorConfig,
    /// How to choose among them.
    pub metric: MetricConfig,
    /// When to believe the best.
    pub verdict: VerdictConfig,
}

/// The choice of a sampling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SamplingConfig {
    /// Every point is used.
    None {},
    /// One centroid for each occupied cell.
    VoxelGrid(VoxelGridConfig),
}

/// Settings of `[sampling.voxel-grid]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct VoxelGridConfig {
    /// Side of a cell; `pr` is here the resolution of the scans as they came.
    pub leaf: Length,
}

/// Where normals come from. Descriptors need them with the same sign convention on both scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct NormalsConfig {
    /// Estimated, or taken from the scan.
    pub source: NormalSource,
    /// Neighbours that a normal is estimated from, the point itself included.
    pub neighbors: usize,
    /// Which side is the outside.
    pub orientation: Orientation,
}

/// Where normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalSource {
    /// By principal component analysis, always.
    #[default]
    Estimated,
    /// The mesh's (from its triangles) or the file's own, where the scan has them; estimated elsewhere.
    Given,
}

/// When a pose is believed: it must have more inliers than chance explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct VerdictConfig {
    /// Residuals below it are inliers.
    pub inlier_threshold: Length,
    /// Random poses as good as this one that may be expected among all trials.
    pub max_false_alarms: f64,
}

impl Default for PipelineConfig {
    fn default() -> Self {
        PipelineConfig {
            seed: 0,
            sampling: SamplingConfig::default(),
            normals: NormalsConfig::default(),
            detector: DetectorConfig::Harris(HarrisConfig::default()),
            support: SupportFilter::default(),
            descriptor: DescriptorConfig::default(),
            matcher: MatcherConfig::default(),
            estimator: EstimatorConfig::default(),
            metric: MetricConfig::default(),
            verdict: VerdictConfig::default(),
        }
    }
}

impl Default for SamplingConfig {
    fn default() -> Self {
        SamplingConfig::VoxelGrid(VoxelGridConfig::default())
    }
}

impl Default for VoxelGridConfig {
    fn default() -> Self {
        VoxelGridConfig { leaf: Length::Resolutions(2.0) }
    }
}

impl Default for NormalsConfig {
    fn default() -> Self {
        NormalsConfig { source: NormalSource::default(), neighbors: 50, orientation: Orientation::Propagate {} }
    }
}

impl Default for VerdictConfig {
    fn default() -> Self {
        VerdictConfig { inlier_threshold: Length::Resolutions(7.5), max_false_alarms: 1e-3 }
    }
}
