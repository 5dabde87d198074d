//! The answer.

use crate::{Failure, Pair, StageTime};
use congruent_geometry::RigidTransform;

/// Whether the pose is to be believed.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Far more inliers than chance explains.
    Ok,
    /// No pose, or one that chance explains.
    Failed(Failure),
}

/// How much of what there was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Points of the scans as they came, without the dropped ones.
    pub points: Pair<usize>,
    /// Points after sampling.
    pub sampled: Pair<usize>,
    /// Keypoints with enough support.
    pub keypoints: Pair<usize>,
    /// Keypoints with a valid descriptor.
    pub described: Pair<usize>,
    /// Correspondences kept.
    pub correspondences: usize,
    /// Of them, inliers of the best pose.
    pub inliers: usize,
}

/// The answer for one pair of scans.
#[derive(Clone, Debug)]
pub struct Registration {
    /// Maps source coordinates into the target's frame, both as in the files. The best guess where the verdict is
    /// `Failed`, if there is any.
    pub target_from_source: Option<RigidTransform>,
    /// Whether to believe it.
    pub verdict: Verdict,
    /// How far beyond chance the inliers are, 0 to 1, one half at the border between the verdicts. Not calibrated.
    pub confidence: f64,
    /// By the configured metric.
    pub score: Option<f64>,
    /// What each stage left.
    pub counts: Counts,
    /// Mean resolution of the scans as they came, data units.
    pub raw_resolution: f64,
    /// Mean resolution of the sampled clouds, data units: `pr` for all stages but sampling. Zero if sampling failed.
    pub resolution: f64,
    /// Wall time of each stage that ran.
    pub timings: Vec<StageTime>,
}
