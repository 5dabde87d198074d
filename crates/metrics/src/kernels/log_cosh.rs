//! The log-cosh kernel.

use super::table::Table;
use super::{Kernel, inlier_share};

/// Log-cosh: `lc(t − e) / lc(t)` with `lc(x) = ln cosh x`, both lengths in units of the resolution.
///
/// The only metric whose shape depends on that unit: a small `t` turns it into MSE, a large one into MAE.
#[derive(Clone, Debug)]
pub struct LogCosh {
    per_threshold: f32,
    /// In units of the resolution.
    threshold: f64,
    /// Gains as a function of `u`.
    gains: Table,
}

impl LogCosh {
    /// Creates the kernel; `threshold` in data units, `resolution` the unit in which it is measured.
    #[must_use]
    pub fn new(threshold: f64, resolution: f64) -> Self {
        let t = threshold / resolution;
        let gains = Table::new(|u| ln_cosh(t * (1.0 - u)) / ln_cosh(t));
        LogCosh { per_threshold: (1.0 / threshold) as f32, threshold: t, gains }
    }
}

impl Kernel for LogCosh {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        self.gains.at(residual_sq.sqrt() * self.per_threshold)
    }

    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.per_threshold).map_or(0.0, |u| (self.threshold * (1.0 - u)).tanh() / u)
    }
}

/// Returns `ln cosh x` without overflow, and without cancellation near zero.
fn ln_cosh(x: f64) -> f64 {
    let x = x.abs();
    if x < 1e-2 {
        let sq = x * x;
        sq * (0.5 - sq * (1.0 / 12.0 - sq / 45.0))
    } else {
        x + (-2.0 * x).exp().ln_1p() - std::f64::consts::LN_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_cosh_is_table_and_formula_alike_in_any_unit() {
        for (t, middle) in [(0.1, 0.2503), (1.0, 0.2769), (20.0, 0.4820)] {
            let kernel = LogCosh::new(t * 0.6, 0.6);
            for i in 0..500 {
                let u = f64::from(i) / 499.0;
                let exact = ln_cosh(t * (1.0 - u)) / ln_cosh(t);
                let gain = f64::from(kernel.gain((u * t * 0.6).powi(2) as f32));
                assert!((gain - exact).abs() < 1e-4, "t = {t}, u = {u}: {gain} {exact}");
            }
            assert!((f64::from(kernel.gain((0.5 * t * 0.6).powi(2) as f32)) - middle).abs() < 1e-4);
        }
        assert!((ln_cosh(7.5) - 6.806_853_125_342_328).abs() < 1e-14 && ln_cosh(1e5).is_finite());
        assert!((ln_cosh(0.009_999) - ln_cosh(0.010_001)).abs() < 2e-8);
    }
}
