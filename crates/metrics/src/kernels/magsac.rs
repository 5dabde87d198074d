//! MAGSAC++: the inlier bound averaged over all noise levels.

use super::Kernel;
use super::table::Table;

/// The 0.99 quantile of the χ distribution with 3 degrees of freedom: the threshold in standard deviations.
const QUANTILE: f64 = 3.368_214_175_219;

/// MAGSAC++ (Baráth et al. 2020) for residuals of 3 degrees of freedom, where its loss has a closed form.
///
/// With `σ = t/k`, `x = e²/2σ²` and `K = k²/2` the loss is `ρ = σ² (1 − exp(−x) − x exp(−K))`; the gain is
/// `1 − ρ/ρ(t)`. It is EXP without the drop at the threshold.
#[derive(Clone, Debug)]
pub struct Magsac {
    per_threshold_sq: f32,
    /// Gains as a function of `u²`.
    gains: Table,
}

impl Magsac {
    /// Creates the kernel; `threshold` in data units: residuals of inliers stay below it 99 times in 100.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        let gains = Table::new(|share_sq| 1.0 - loss(share_sq * LIMIT) / loss(LIMIT));
        Magsac { per_threshold_sq: (1.0 / (threshold * threshold)) as f32, gains }
    }
}

impl Kernel for Magsac {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        self.gains.at(residual_sq * self.per_threshold_sq)
    }

    fn weight(&self, residual: f64) -> f64 {
        let x = residual * residual * f64::from(self.per_threshold_sq) * LIMIT;
        ((-x).exp() - (-LIMIT).exp()).max(0.0)
    }
}

/// The value of `x` at the threshold.
const LIMIT: f64 = QUANTILE * QUANTILE / 2.0;

/// Returns `ρ/σ²` at `x`.
fn loss(x: f64) -> f64 {
    1.0 - (-x).exp() - x * (-LIMIT).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loss_is_the_integral_of_weight_times_residual() {
        let kernel = Magsac::new(7.5);
        let steps = 20_000;
        let mut sums = vec![0.0];
        for i in 0..steps {
            let r = (f64::from(i) + 0.5) * 7.5 / f64::from(steps);
            sums.push(sums[i as usize] + kernel.weight(r) * r);
        }
        for i in (0..=steps as usize).step_by(500) {
            let r = i as f64 * 7.5 / f64::from(steps);
            let gain = f64::from(kernel.gain((r * r) as f32));
            let integral = 1.0 - sums[i] / sums[steps as usize];
            assert!((gain - integral).abs() < 1e-5, "{r}: {gain} {integral}");
        }
    }

    #[test]
    fn the_quantile_is_that_of_three_degrees_of_freedom() {
        // Density of χ₃: √(2/π) r² exp(−r²/2), by the midpoint rule.
        let n = 100_000;
        let step = QUANTILE / f64::from(n);
        let density = |r: f64| (2.0 / std::f64::consts::PI).sqrt() * r * r * (-r * r / 2.0).exp();
        let mass: f64 = (0..n).map(|i| density((f64::from(i) + 0.5) * step) * step).sum();
        assert!((mass - 0.99).abs() < 1e-8, "{mass}");
    }
}
