//! What every detector does.

use congruent_geometry::Surface;

/// A point of a surface that stands out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Position in the surface's points.
    pub index: u32,
    /// How much it stands out; larger is more. Comparable only within one run of one detector.
    pub response: f64,
}

/// Points that one thread looks around at a time, at most: the last of them must not keep the other threads waiting.
pub(crate) const POINTS_AT_A_TIME: usize = 256;

/// Picks points of a surface that can be found again in another scan of the same thing.
pub trait Detector: Send + Sync {
    /// The keypoints, by ascending index, each once. The same for any number of threads.
    fn detect(&self, surface: &Surface) -> Vec<Keypoint>;
}
