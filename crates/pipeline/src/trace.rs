//! What the stages produced on the way to an answer.

use crate::Pair;
use congruent_descriptors::Features;
use congruent_estimators::Hypothesis;
use congruent_geometry::Surface;
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;

/// What each stage produced, for inspection. Fields of stages that were not reached are empty.
#[derive(Default)]
pub struct Trace {
    /// Sampled points with normals, centred; indices of points in the other fields refer to them.
    pub surfaces: Option<Pair<Surface>>,
    /// Keypoints with enough support.
    pub keypoints: Pair<Vec<Keypoint>>,
    /// One row for each keypoint that could be described.
    pub features: Pair<Features>,
    /// Correspondences, best first.
    pub matches: Vec<Correspondence>,
    /// The pool of poses from which the ranking chose, best first by the metric; between the centred clouds.
    pub pool: Vec<Hypothesis>,
}
