//! The a-contrario test: whether the best pose is better than chance explains.
//!
//! If the matches were random, how many of the poses tried would have this many inliers? The probability that a single
//! random match is an inlier is measured under the pose itself: the fraction of *all* combinations of a matched source
//! point with a matched target point that coincide. So a pose that puts a plane on a plane, where many points coincide
//! anyway, needs a higher count.

use crate::{AContrarioConfig, Failure};
use congruent_geometry::RigidTransform;
use congruent_metrics::Evidence;
use multiversion::multiversion;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Number of correspondences that determined the pose and thus fit it anyway.
const SAMPLE_SIZE: usize = 3;
/// Minimum number of source points whose combinations one thread counts at a time.
const COUNTED_AT_A_TIME: usize = 128;

/// The result of the test.
pub(crate) struct Significance {
    /// Number of correspondences that are inliers of the pose.
    pub(crate) inliers: usize,
    /// Decimal logarithm of the expected number of random poses this good.
    pub(crate) log10_false_alarms: f64,
    /// Number of inliers expected if the matches were random.
    expected: f64,
    matches: usize,
}

impl Significance {
    /// Tests a pose that was the best of `trials`; residuals below `threshold` (data units) are inliers.
    pub(crate) fn of(pose: &RigidTransform, evidence: &Evidence, threshold: f64, trials: u64) -> Self {
        let (matches, inliers) = (evidence.len(), evidence.inliers(pose, threshold).len());
        let chance = chance_of_inlier(pose, evidence, threshold);
        let (free, hits) = (matches.saturating_sub(SAMPLE_SIZE), inliers.saturating_sub(SAMPLE_SIZE));
        let ln_false_alarms = (trials.max(1) as f64).ln() + ln_binomial_tail(free, hits, chance);
        Significance {
            inliers,
            log10_false_alarms: ln_false_alarms / std::f64::consts::LN_10,
            expected: chance * matches as f64,
            matches,
        }
    }

    /// Returns the confidence, which is one half at the border, and the doubt if the pose is not significant.
    pub(crate) fn judge(&self, config: &AContrarioConfig) -> (f64, Option<Failure>) {
        let margin = config.max_false_alarms.log10() - self.log10_false_alarms;
        let doubt = (margin <= 0.0).then_some(Failure::NotSignificant {
            inliers: self.inliers,
            matches: self.matches,
            expected: self.expected,
            log10_false_alarms: self.log10_false_alarms,
        });
        (1.0 / (1.0 + 10f64.powf(-margin)), doubt)
    }
}

/// Returns the fraction of all (source point, target point) combinations that the pose puts closer than `threshold`;
/// never zero, because one combination is added to both counts.
fn chance_of_inlier(pose: &RigidTransform, evidence: &Evidence, threshold: f64) -> f64 {
    let n = evidence.len();
    let targets: Vec<Vector3<f64>> = (0..n).map(|i| evidence.target(i)).collect();
    let columns: [Vec<f64>; 3] = std::array::from_fn(|axis| targets.iter().map(|target| target[axis]).collect());
    let near = |i: usize| {
        let moved = pose * Point3::from(evidence.source(i));
        count_near(moved.into(), columns.each_ref().map(Vec::as_slice), threshold * threshold)
    };
    let together: u64 = (0..n).into_par_iter().with_min_len(COUNTED_AT_A_TIME).map(near).sum();
    ((together as f64 + 1.0) / ((n * n) as f64 + 1.0)).min(1.0)
}

/// Counts the positions, given by one list for each coordinate, that are closer to a point than a limit.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn count_near(point: [f64; 3], [xs, ys, zs]: [&[f64]; 3], limit_sq: f64) -> u64 {
    let mut near = 0;
    for ((x, y), z) in xs.iter().zip(ys).zip(zs) {
        let [x, y, z] = [point[0] - x, point[1] - y, point[2] - z];
        near += u64::from(x * x + y * y + z * z < limit_sq);
    }
    near
}

/// Returns `ln P[B ≥ k]` for a binomial count of `n` draws with probability `p`.
fn ln_binomial_tail(n: usize, k: usize, p: f64) -> f64 {
    if k == 0 || p >= 1.0 {
        return 0.0;
    }
    let mut ln_factorial = vec![0.0f64; n + 1];
    for i in 1..=n {
        ln_factorial[i] = ln_factorial[i - 1] + (i as f64).ln();
    }
    let ln_term = |i: usize| {
        ln_factorial[n] - ln_factorial[i] - ln_factorial[n - i] + i as f64 * p.ln() + (n - i) as f64 * (-p).ln_1p()
    };
    let terms: Vec<f64> = (k..=n).map(ln_term).collect();
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (largest + terms.iter().map(|t| (t - largest).exp()).sum::<f64>().ln()).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    #[test]
    fn the_binomial_tail_is_exact_and_does_not_underflow() {
        for (n, k, p, expected) in [
            (10usize, 8usize, 0.5f64, 56.0f64 / 1024.0),
            (3, 3, 0.1, 0.001),
            (5, 0, 0.3, 1.0),
            (4, 1, 0.25, 1.0 - 0.75f64.powi(4)),
        ] {
            assert!((ln_binomial_tail(n, k, p).exp() - expected).abs() < 1e-12);
        }
        let far = ln_binomial_tail(2000, 1500, 1e-3);
        assert!(far.is_finite() && far < -5000.0);
    }

    /// `n` pairs in a box of side 100 (its height times `flat`), the first `right` of them at rest, the others random.
    fn scene(n: usize, right: usize, flat: f64) -> Evidence {
        let mut stream = Stream::new(2, n as u64);
        let mut point = || {
            [
                stream.between(0.0, 100.0) as f32,
                stream.between(0.0, 100.0) as f32,
                (flat * stream.between(0.0, 100.0)) as f32,
            ]
        };
        Evidence::new(
            (0..n)
                .map(|i| {
                    let p = point();
                    (p, if i < right { p } else { point() })
                })
                .collect::<Vec<_>>(),
        )
    }

    fn false_alarms(evidence: &Evidence, threshold: f64) -> f64 {
        Significance::of(&RigidTransform::identity(), evidence, threshold, 1000).log10_false_alarms
    }

    #[test]
    fn inliers_beyond_chance_are_significant_and_chance_is_not() {
        assert!(false_alarms(&scene(300, 30, 1.0), 7.5) < -10.0);
        assert!(false_alarms(&scene(300, 3, 1.0), 7.5) > 0.0);
        assert!(false_alarms(&scene(3, 3, 1.0), 7.5) > 0.0);
        assert!(false_alarms(&Evidence::default(), 7.5) > 0.0);
    }

    #[test]
    fn the_same_count_means_less_where_everything_falls_together() {
        let (space, plane) = (false_alarms(&scene(300, 12, 1.0), 15.0), false_alarms(&scene(300, 12, 0.0), 15.0));
        assert!(plane > space + 2.0, "{plane} {space}");
    }
}
