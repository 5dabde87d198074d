//! The exponential kernel.

use super::Kernel;

/// Exponential: `exp(−u²/2)`, which drops from 0.607 to zero at the threshold.
#[derive(Clone, Copy, Debug)]
pub struct Exp {
    per_threshold_sq: f32,
}

impl Exp {
    /// Creates the kernel; `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Exp { per_threshold_sq: (1.0 / (threshold * threshold)) as f32 }
    }
}

impl Kernel for Exp {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let x = -0.5 * residual_sq * self.per_threshold_sq;
        // Taylor series to the seventh power: on [-1/2, 0] its error is below 1e-7.
        let series = 1.0
            + x * (1.0
                + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0))))));
        if x > -0.5 { series } else { 0.0 }
    }

    fn weight(&self, residual: f64) -> f64 {
        let share_sq = residual * residual * f64::from(self.per_threshold_sq);
        if share_sq < 1.0 { (-0.5 * share_sq).exp() } else { 0.0 }
    }
}
