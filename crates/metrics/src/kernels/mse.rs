//! Mean squared error.

use super::{Kernel, Mae, inlier_share};

/// Mean squared error: `(1 − u)²`.
#[derive(Clone, Copy, Debug)]
pub struct Mse {
    mae: Mae,
}

impl Mse {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Mse { mae: Mae::new(threshold) }
    }
}

impl Kernel for Mse {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let gain = self.mae.gain(residual_sq);
        gain * gain
    }

    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.mae.per_threshold).map_or(0.0, |u| (1.0 - u) / u)
    }
}
