//! The inlier count.

use super::Kernel;

/// Inliers count one, outliers zero: the classical RANSAC score.
#[derive(Clone, Copy, Debug)]
pub struct InlierCount {
    threshold_sq: f32,
}

impl InlierCount {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        InlierCount { threshold_sq: (threshold * threshold) as f32 }
    }
}

impl Kernel for InlierCount {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        if residual_sq < self.threshold_sq { 1.0 } else { 0.0 }
    }

    fn weight(&self, residual: f64) -> f64 {
        if residual * residual < f64::from(self.threshold_sq) { 1.0 } else { 0.0 }
    }
}
