//! The error that SAC-IA minimises.

use super::Kernel;

/// Truncated error (Rusu et al. 2009, as it is mostly used): every pair costs `min(u, 1)`.
///
/// On the same pairs it is MAE minus their number, so it ranks poses as MAE does.
#[derive(Clone, Copy, Debug)]
pub struct TruncatedError {
    mae: super::Mae,
}

impl TruncatedError {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        TruncatedError { mae: super::Mae::new(threshold) }
    }
}

impl Kernel for TruncatedError {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        self.mae.gain(residual_sq) - 1.0
    }

    fn weight(&self, residual: f64) -> f64 {
        self.mae.weight(residual)
    }
}
