//! Gains of a residual: the metrics of the paper, one struct each.
//!
//! `e` is the residual, `t` the threshold, `u = e/t`; an inlier has `e < t`, strictly.

/// Values of LOG-COSH kept ready; linear interpolation between them errs by less than 1e-5.
const LOG_COSH_STEPS: usize = 1024;

/// What one pair adds to a score.
pub trait Kernel: Clone + Send + Sync {
    /// The gain of a squared residual, data units squared. Finite for every finite residual.
    fn gain(&self, residual_sq: f32) -> f32;

    /// Weight of a pair in the least-squares fit that raises the sum of gains: `−gain'(e) / e`, up to a constant factor
    /// that all pairs share. Zero for outliers; finite, because residuals below a thousandth of the threshold count as
    /// that.
    fn weight(&self, residual: f64) -> f64;
}

/// Smallest residual that a weight tells apart from zero, as a share of the threshold.
const MIN_SHARE: f64 = 1e-3;

/// `e / t` of an inlier, kept away from zero; nothing for an outlier.
fn inlier_share(residual: f64, per_threshold: f32) -> Option<f64> {
    let share = residual * f64::from(per_threshold);
    (share < 1.0).then(|| share.max(MIN_SHARE))
}

/// Inliers count one, outliers nothing: the classical RANSAC score.
#[derive(Clone, Copy, Debug)]
pub struct InlierCount {
    threshold_sq: f32,
}

impl InlierCount {
    /// `threshold` in data units.
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

/// Mean absolute error: `1 − u`.
#[derive(Clone, Copy, Debug)]
pub struct Mae {
    per_threshold: f32,
}

impl Mae {
    /// `threshold` in data units.
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

/// Mean squared error: `(1 − u)²`.
#[derive(Clone, Copy, Debug)]
pub struct Mse(Mae);

impl Mse {
    /// `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Mse(Mae::new(threshold))
    }
}

impl Kernel for Mse {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let gain = self.0.gain(residual_sq);
        gain * gain
    }

    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.0.per_threshold).map_or(0.0, |u| (1.0 - u) / u)
    }
}

/// Log-cosh: `lc(t − e) / lc(t)` with `lc(x) = ln cosh x`, both lengths in units of the resolution.
///
/// The only metric whose shape depends on that unit: a small `t` makes it MSE, a large one MAE.
#[derive(Clone, Debug)]
pub struct LogCosh {
    per_threshold: f32,
    /// In units of the resolution.
    threshold: f64,
    /// Gains at `u = i / LOG_COSH_STEPS`, and a zero beyond the threshold.
    table: Box<[f32; LOG_COSH_STEPS + 2]>,
}

impl LogCosh {
    /// `threshold` in data units, `resolution` what it is measured in.
    #[must_use]
    pub fn new(threshold: f64, resolution: f64) -> Self {
        let t = threshold / resolution;
        let at = |i: usize| (ln_cosh(t * (1.0 - i as f64 / LOG_COSH_STEPS as f64)) / ln_cosh(t)) as f32;
        let table = std::array::from_fn(|i| if i < LOG_COSH_STEPS { at(i) } else { 0.0 });
        LogCosh { per_threshold: (1.0 / threshold) as f32, threshold: t, table: Box::new(table) }
    }
}

impl Kernel for LogCosh {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let place = (residual_sq.sqrt() * self.per_threshold).min(1.0) * LOG_COSH_STEPS as f32;
        let step = (place as usize).min(LOG_COSH_STEPS);
        let (low, high) = (self.table[step], self.table[step + 1]);
        low + (high - low) * (place - step as f32)
    }

    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.per_threshold).map_or(0.0, |u| (self.threshold * (1.0 - u)).tanh() / u)
    }
}

/// `ln cosh x` without overflow, and without cancellation near zero.
fn ln_cosh(x: f64) -> f64 {
    let x = x.abs();
    if x < 1e-2 {
        let sq = x * x;
        sq * (0.5 - sq * (1.0 / 12.0 - sq / 45.0))
    } else {
        x + (-2.0 * x).exp().ln_1p() - std::f64::consts::LN_2
    }
}

/// Exponential: `exp(−u²/2)`, which drops from 0.607 to nothing at the threshold.
#[derive(Clone, Copy, Debug)]
pub struct Exp {
    per_threshold_sq: f32,
}

impl Exp {
    /// `threshold` in data units.
    #[must_use]
    pub fn new(threshold: f64) -> Self {
        Exp { per_threshold_sq: (1.0 / (threshold * threshold)) as f32 }
    }
}

impl Kernel for Exp {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let x = -0.5 * residual_sq * self.per_threshold_sq;
        // Taylor's series to the seventh power: on [-1/2, 0] it errs by less than 1e-7.
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

/// What QUANTILE makes of an outlier, `(1 − m)(1 − 1/u)`: added or taken off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuantileOutliers {
    /// QUANTILE: a far outlier adds up to `1 − m`, more than a loose inlier. Perverse by design; the paper has it.
    Add,
    /// −QUANTILE: a far outlier costs up to `1 − m`.
    Subtract,
}

/// QUANTILE and −QUANTILE: inliers gain `m(1 − u)`, outliers `±(1 − m)(1 − 1/u)`.
#[derive(Clone, Copy, Debug)]
pub struct Quantile {
    per_threshold: f32,
    inlier_share: f32,
    outlier_share: f32,
}

impl Quantile {
    /// `threshold` in data units, `m` between 0 and 1 (the paper: 0.9).
    #[must_use]
    pub fn new(threshold: f64, m: f64, outliers: QuantileOutliers) -> Self {
        let sign = match outliers {
            QuantileOutliers::Add => 1.0,
            QuantileOutliers::Subtract => -1.0,
        };
        Quantile {
            per_threshold: (1.0 / threshold) as f32,
            inlier_share: m as f32,
            outlier_share: (sign * (1.0 - m)) as f32,
        }
    }
}

impl Kernel for Quantile {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let u = residual_sq.sqrt() * self.per_threshold;
        if u < 1.0 { self.inlier_share * (1.0 - u) } else { self.outlier_share * (1.0 - 1.0 / u) }
    }

    // Outliers pull the wrong way in QUANTILE and hardly at all in its negative: only inliers are fitted.
    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.per_threshold).map_or(0.0, |u| 1.0 / u)
    }
}

/// Huber penalty (Rusu 2009), as a gain: `−u²/2` for inliers, `−(u − 1/2)` beyond. Not truncated, so outliers rule it.
#[derive(Clone, Copy, Debug)]
pub struct Huber {
    per_threshold: f32,
}

impl Huber {
    /// `threshold` (δ) in data units; the penalty is in units of δ².
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

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, kernel: &impl Kernel, expected: [f64; 9]) {
        // Residuals in units of the resolution, t = 7.5 of them.
        for (e, expected) in [0.0f32, 1.0, 2.5, 3.75, 5.0, 7.0, 7.5, 15.0, 75.0].into_iter().zip(expected) {
            let gain = f64::from(kernel.gain(e * e));
            assert!((gain - expected).abs() < 2e-6, "{name} at {e}: {gain}, expected {expected}");
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
    }

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
        }
    }
}
