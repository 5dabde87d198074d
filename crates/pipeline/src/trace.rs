//! What the stages left on the way to an answer.

use crate::Pair;
use congruent_descriptors::Features;
use congruent_estimators::Hypothesis;
use congruent_geometry::Surface;
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;

/// What each stage made, for those who want to look at it. Stages that were not reached left nothing.
#[derive(Default)]
pub struct Trace {
    /// Sampled points with normals, centred; what positions in all other fields refer to.
    pub surfaces: Option<Pair<Surface>>,
    /// With enough support.
    pub keypoints: Pair<Vec<Keypoint>>,
    /// One row for each keypoint that could be described.
    pub features: Pair<Features>,
    /// Best first.
    pub matches: Vec<Correspondence>,
    /// The poses that were looked at closely, best first by the metric; between the centred clouds.
    pub pool: Vec<Hypothesis>,
}
