//! The interface of all detectors.

use congruent_geometry::Surface;

/// A salient point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Position in the surface's points.
    pub index: u32,
    /// How salient it is; larger is more. Comparable only within one run of one detector.
    pub response: f64,
}

/// Maximum number of points that one thread examines at a time: the last of them must not keep other threads waiting.
pub(crate) const POINTS_AT_A_TIME: usize = 256;

/// Picks points of a surface that can be found again in another scan of the same object.
pub trait Detector: Send + Sync {
    /// Returns the keypoints, by ascending index, each once; the same for any number of threads.
    fn detect(&self, surface: &Surface) -> Vec<Keypoint>;
}
