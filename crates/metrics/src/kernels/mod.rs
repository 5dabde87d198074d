//! Gains as functions of a residual: the metrics over correspondences, one struct each.
//!
//! `e` is the residual, `t` the threshold, `u = e/t`; an inlier has `e < t`, strictly.

mod exp;
mod huber;
mod inlier_count;
mod log_cosh;
mod mae;
mod magsac;
mod msac;
mod mse;
mod quantile;
mod table;
mod truncated;

pub use exp::Exp;
pub use huber::Huber;
pub use inlier_count::InlierCount;
pub use log_cosh::LogCosh;
pub use mae::Mae;
pub use magsac::Magsac;
pub use msac::Msac;
pub use mse::Mse;
pub use quantile::{Quantile, QuantileOutliers};
pub use truncated::TruncatedError;

/// The gain of a pair: what it adds to a score.
pub trait Kernel: Clone + Send + Sync {
    /// Returns the gain of a squared residual, data units squared; finite for every finite residual.
    fn gain(&self, residual_sq: f32) -> f32;

    /// Returns the weight of a pair in the least-squares fit that raises the sum of gains: `−gain'(e) / e`, up to a
    /// constant factor that all pairs share. Zero for outliers, unless the gain falls without bound (Huber); finite,
    /// because residuals below a thousandth of the threshold are raised to that.
    fn weight(&self, residual: f64) -> f64;
}

/// Smallest residual that a weight distinguishes from zero, as a fraction of the threshold.
const MIN_SHARE: f64 = 1e-3;

/// Returns `e / t` of an inlier, bounded away from zero; `None` for an outlier.
fn inlier_share(residual: f64, per_threshold: f32) -> Option<f64> {
    let share = residual * f64::from(per_threshold);
    (share < 1.0).then(|| share.max(MIN_SHARE))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, kernel: &impl Kernel, expected: [f64; 9]) {
        // Residuals in units of the resolution, t = 7.5 of them.
        for (e, expected) in [0.0f32, 1.0, 2.5, 3.75, 5.0, 7.0, 7.5, 15.0, 75.0].into_iter().zip(expected) {
            let gain = f64::from(kernel.gain(e * e));
            // Gains from a table are slightly off; the others differ by rounding.
            assert!((gain - expected).abs() < 5e-6, "{name} at {e}: {gain}, expected {expected}");
        }
    }

    #[test]
    fn gains_are_those_of_the_formulas() {
        let t = 7.5;
        check("mae", &Mae::new(t), [1.0, 0.866_667, 0.666_667, 0.5, 0.333_333, 0.066_667, 0.0, 0.0, 0.0]);
        check("mse", &Mse::new(t), [1.0, 0.751_111, 0.444_444, 0.25, 0.111_111, 0.004_444, 0.0, 0.0, 0.0]);
        check(
            "log-cosh",
            &LogCosh::new(t, 1.0),
            [1.0, 0.853_090, 0.632_730, 0.449_166, 0.266_433, 0.017_646, 0.0, 0.0, 0.0],
        );
        check("exp", &Exp::new(t), [1.0, 0.991_151, 0.945_959, 0.882_497, 0.800_737, 0.646_905, 0.0, 0.0, 0.0]);
        let quantile = Quantile::new(t, 0.9, QuantileOutliers::Add);
        check("quantile", &quantile, [0.9, 0.78, 0.6, 0.45, 0.3, 0.06, 0.0, 0.05, 0.09]);
        let negative = Quantile::new(t, 0.9, QuantileOutliers::Subtract);
        check("-quantile", &negative, [0.9, 0.78, 0.6, 0.45, 0.3, 0.06, 0.0, -0.05, -0.09]);
        check("inliers", &InlierCount::new(t), [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let huber = [0.0, -1.0 / 112.5, -1.0 / 18.0, -0.125, -2.0 / 9.0, -0.435_556, -0.5, -1.5, -9.5];
        check("huber", &Huber::new(t), huber);
        check("msac", &Msac::new(t), [1.0, 0.982_222, 0.888_889, 0.75, 0.555_556, 0.128_889, 0.0, 0.0, 0.0]);
        check("magsac", &Magsac::new(t), [1.0, 0.902_177, 0.523_684, 0.229_363, 0.067_647, 0.001_219, 0.0, 0.0, 0.0]);
        let truncated = [0.0, -0.133_333, -0.333_333, -0.5, -0.666_667, -0.933_333, -1.0, -1.0, -1.0];
        check("sac-ia", &TruncatedError::new(t), truncated);
    }

    #[test]
    fn an_inlier_lies_strictly_below_the_threshold() {
        fn check(name: &str, kernel: &impl Kernel, below: f64, at: f64) {
            let t = 7.5f32;
            for (residual_sq, expected) in [((t * 0.999_999).powi(2), below), (t * t, at)] {
                let gain = f64::from(kernel.gain(residual_sq));
                assert!((gain - expected).abs() < 5e-6, "{name} at {residual_sq}: {gain}, expected {expected}");
            }
        }
        let t = 7.5;
        check("inliers", &InlierCount::new(t), 1.0, 0.0);
        check("mae", &Mae::new(t), 0.0, 0.0);
        check("mse", &Mse::new(t), 0.0, 0.0);
        check("log-cosh", &LogCosh::new(t, 1.0), 0.0, 0.0);
        check("exp", &Exp::new(t), (-0.5f64).exp(), 0.0);
        check("quantile", &Quantile::new(t, 0.9, QuantileOutliers::Add), 0.0, 0.0);
        check("-quantile", &Quantile::new(t, 0.9, QuantileOutliers::Subtract), 0.0, 0.0);
        check("huber", &Huber::new(t), -0.5, -0.5);
        check("msac", &Msac::new(t), 0.0, 0.0);
        check("magsac", &Magsac::new(t), 0.0, 0.0);
        check("sac-ia", &TruncatedError::new(t), -1.0, -1.0);
    }

    #[test]
    fn gains_fall_with_the_residual_and_stay_finite() {
        fn falls(kernel: &impl Kernel, t: f64) {
            let gains: Vec<f32> = (0..1000).map(|i| kernel.gain((f64::from(i) / 1000.0 * t).powi(2) as f32)).collect();
            assert!(gains.windows(2).all(|w| w[1] <= w[0] + 1e-6));
            for far in [1e6f32, 1e30, f32::MAX] {
                assert!(kernel.gain(far).is_finite());
            }
        }
        for t in [1e-3, 7.5, 4e4] {
            falls(&InlierCount::new(t), t);
            falls(&Mae::new(t), t);
            falls(&Mse::new(t), t);
            falls(&LogCosh::new(t, t / 7.5), t);
            falls(&Exp::new(t), t);
            falls(&Quantile::new(t, 0.9, QuantileOutliers::Add), t);
            falls(&Quantile::new(t, 0.9, QuantileOutliers::Subtract), t);
            falls(&Huber::new(t), t);
            falls(&Msac::new(t), t);
            falls(&Magsac::new(t), t);
            falls(&TruncatedError::new(t), t);
        }
    }

    #[test]
    fn weights_are_the_slopes_of_the_gains_over_the_residual() {
        fn check(name: &str, kernel: &impl Kernel, t: f64) {
            let slope = |e: f64| {
                let step = 1e-2 * t;
                let gain = |e: f64| f64::from(kernel.gain((e * e) as f32));
                (gain(e - step) - gain(e + step)) / (2.0 * step * e)
            };
            let factor = slope(0.3 * t) / kernel.weight(0.3 * t);
            for u in [0.1, 0.2, 0.5, 0.7, 0.9] {
                let (weight, slope) = (factor * kernel.weight(u * t), slope(u * t));
                assert!(
                    (weight - slope).abs() < 0.02 * slope.abs() + 1e-3 / (t * t),
                    "{name} at {u}: {weight} {slope}"
                );
            }
            assert!(kernel.weight(0.0).is_finite());
        }
        let t = 7.5;
        check("mae", &Mae::new(t), t);
        check("mse", &Mse::new(t), t);
        check("log-cosh", &LogCosh::new(t, 1.0), t);
        check("exp", &Exp::new(t), t);
        check("huber", &Huber::new(t), t);
        check("msac", &Msac::new(t), t);
        check("magsac", &Magsac::new(t), t);
        check("sac-ia", &TruncatedError::new(t), t);
    }
}
