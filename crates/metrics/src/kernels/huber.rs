//! The penalty of the first SAC-IA.

use super::{Kernel, MIN_SHARE};

/// Huber penalty (Rusu 2009), as a gain: `−u²/2` for inliers, `−(u − 1/2)` beyond. Not truncated, so outliers dominate
/// it.
#[derive(Clone, Copy, Debug)]
pub struct Huber {
    per_threshold: f32,
}

impl Huber {
    /// Creates the kernel; `threshold` (δ) in data units; the penalty is in units of δ².
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Huber { per_threshold: (1.0 / threshold) as f32 }
    }
}

impl Kernel for Huber {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let u = residual_sq.sqrt() * self.per_threshold;
        if u <= 1.0 { -0.5 * u * u } else { 0.5 - u }
    }

    fn weight(&self, residual: f64) -> f64 {
        (1.0 / (residual * f64::from(self.per_threshold)).max(MIN_SHARE)).min(1.0)
    }
}
