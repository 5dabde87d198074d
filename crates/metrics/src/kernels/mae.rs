//! Mean absolute error.

use super::{Kernel, inlier_share};

/// Mean absolute error: `1 − u`.
#[derive(Clone, Copy, Debug)]
pub struct Mae {
    pub(super) per_threshold: f32,
}

impl Mae {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Mae { per_threshold: (1.0 / threshold) as f32 }
    }
}

impl Kernel for Mae {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        (1.0 - residual_sq.sqrt() * self.per_threshold).max(0.0)
    }

    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.per_threshold).map_or(0.0, |u| 1.0 / u)
    }
}
