//! QUANTILE and its negative.

use super::{Kernel, inlier_share};

/// How QUANTILE treats an outlier, `(1 − m)(1 − 1/u)`: added or subtracted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuantileOutliers {
    /// QUANTILE: a far outlier adds up to `1 − m`, more than a loose inlier. Perverse by design; it is what the paper
    /// defines.
    Add,
    /// −QUANTILE: a far outlier costs up to `1 − m`.
    Subtract,
}

/// QUANTILE and −QUANTILE: inliers gain `m(1 − u)`, outliers `±(1 − m)(1 − 1/u)`.
#[derive(Clone, Copy, Debug)]
pub struct Quantile {
    per_threshold: f32,
    inlier_weight: f32,
    outlier_weight: f32,
}

impl Quantile {
    /// Creates the kernel; `threshold` in data units, `m` between 0 and 1 (the paper: 0.9).
    #[must_use]
    pub fn new(threshold: f64, m: f64, outliers: QuantileOutliers) -> Self {
        let sign = match outliers {
            QuantileOutliers::Add => 1.0,
            QuantileOutliers::Subtract => -1.0,
        };
        Quantile {
            per_threshold: (1.0 / threshold) as f32,
            inlier_weight: m as f32,
            outlier_weight: (sign * (1.0 - m)) as f32,
        }
    }
}

impl Kernel for Quantile {
    #[inline(always)]
    fn gain(&self, residual_sq: f32) -> f32 {
        let u = residual_sq.sqrt() * self.per_threshold;
        if u < 1.0 { self.inlier_weight * (1.0 - u) } else { self.outlier_weight * (1.0 - 1.0 / u) }
    }

    // Outliers pull the wrong way in QUANTILE and hardly at all in its negative, so only inliers are fitted.
    fn weight(&self, residual: f64) -> f64 {
        inlier_share(residual, self.per_threshold).map_or(0.0, |u| 1.0 / u)
    }
}
