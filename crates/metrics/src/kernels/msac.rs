//! The truncated square, also known as truncated least squares.

use super::Kernel;

/// MSAC (Torr and Zisserman 2000): `1 − u²`.
#[derive(Clone, Copy, Debug)]
pub struct Msac {
    per_threshold_sq: f32,
}

impl Msac {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Msac { per_threshold_sq: (1.0 / (threshold * threshold)) as f32 }
    }
}

impl Kernel for Msac {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        (1.0 - residual_sq * self.per_threshold_sq).max(0.0)
    }

    // The slope of a square divided by its residual is the same everywhere.
    fn weight(&self, residual: f64) -> f64 {
        if residual * residual * f64::from(self.per_threshold_sq) < 1.0 { 1.0 } else { 0.0 }
    }
}
