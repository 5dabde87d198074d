//! The one hot loop: the gains of the residuals of all pairs under a pose, summed.

use crate::evidence::{LANES, Rest};
use crate::motion::Motion;
use crate::{Evidence, Kernel, Score};
use congruent_geometry::RigidTransform;
use congruent_geometry::lanes::across;
use multiversion::multiversion;

/// Scores a hypothesis.
pub trait Metric: Send + Sync {
    /// Returns how well `target_from_source` explains the evidence. The sum over no correspondences is zero; metrics of
    /// the clouds themselves ignore the evidence.
    fn score(&self, evidence: &Evidence, target_from_source: &RigidTransform) -> Score;

    /// Returns the weight of a pair with this residual (data units) in the least-squares fit that raises the score.
    fn weight(&self, residual: f64) -> f64;

    /// Computes the weights of many pairs, from their squared residuals, into `weights`.
    fn weights(&self, residuals_sq: &[f32], weights: &mut Vec<f64>) {
        weights.clear();
        weights.extend(residuals_sq.iter().map(|residual_sq| self.weight(f64::from(*residual_sq).sqrt())));
    }
}

/// The metric that sums a kernel's gain over all pairs.
#[derive(Clone, Debug)]
pub struct Summed<K>(pub K);

impl<K: Kernel> Metric for Summed<K> {
    fn score(&self, evidence: &Evidence, target_from_source: &RigidTransform) -> Score {
        Score::new(f64::from(total(&self.0, &Motion::new(target_from_source), evidence)))
    }

    fn weight(&self, residual: f64) -> f64 {
        self.0.weight(residual)
    }
}

impl Motion {
    /// Returns the squared residuals of [`LANES`] pairs, one row of the pose after the other, so that each of its
    /// numbers is loaded once for all pairs.
    #[inline(always)]
    fn residuals_sq(&self, p: [&[f32; LANES]; 3], [qx, qy, qz]: [&[f32; LANES]; 3]) -> [f32; LANES] {
        let z = self.along(2, p, qz);
        let y = self.along(1, p, qy);
        let x = self.along(0, p, qx);
        let mut sum = [0.0; LANES];
        for lane in 0..LANES {
            sum[lane] = x[lane] * x[lane] + (y[lane] * y[lane] + z[lane] * z[lane]);
        }
        sum
    }

    #[inline(always)]
    fn along(&self, row: usize, [px, py, pz]: [&[f32; LANES]; 3], q: &[f32; LANES]) -> [f32; LANES] {
        let mut along = [0.0; LANES];
        for lane in 0..LANES {
            along[lane] = self.along_one(row, [px[lane], py[lane], pz[lane]], q[lane]);
        }
        along
    }

    #[inline(always)]
    fn along_one(&self, row: usize, p: [f32; 3], q: f32) -> f32 {
        let [a, b, c] = self.linear[row];
        a * p[0] + (b * p[1] + (c * p[2] + (self.shift[row] - q)))
    }

    /// Returns the squared residual of a single pair.
    #[inline(always)]
    fn residual_sq(&self, p: [f32; 3], q: [f32; 3]) -> f32 {
        let (x, y, z) = (self.along_one(0, p, q[0]), self.along_one(1, p, q[1]), self.along_one(2, p, q[2]));
        x * x + (y * y + z * z)
    }
}

/// Sums the gains of all pairs, lane by lane, in a fixed order.
fn total<K: Kernel>(kernel: &K, pose: &Motion, evidence: &Evidence) -> f32 {
    let mut sums = [0.0f32; LANES];
    add_gains(kernel, pose, evidence, &mut sums);
    across(sums)
}

/// Computes the sum of the gains in each lane. Compiled for several instruction sets and chosen at run time. No product
/// is fused with a sum, and the lanes are added in a fixed order, so the bits are the same on all of them. The sums are
/// returned through memory: if they were added up here, the compiler would split the registers.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn add_gains<K: Kernel>(kernel: &K, pose: &Motion, evidence: &Evidence, sums: &mut [f32; LANES]) {
    let [px, py, pz] = evidence.source.each_ref().map(|axis| axis.as_chunks::<LANES>());
    let [qx, qy, qz] = evidence.target.each_ref().map(|axis| axis.as_chunks::<LANES>());
    let blocks = px.0.len();
    let (py_blocks, pz_blocks) = (&py.0[..blocks], &pz.0[..blocks]);
    let (qx_blocks, qy_blocks, qz_blocks) = (&qx.0[..blocks], &qy.0[..blocks], &qz.0[..blocks]);
    let mut own = [0.0f32; LANES];
    for b in 0..blocks {
        let p = [&px.0[b], &py_blocks[b], &pz_blocks[b]];
        let q = [&qx_blocks[b], &qy_blocks[b], &qz_blocks[b]];
        let residuals_sq = pose.residuals_sq(p, q);
        for lane in 0..LANES {
            own[lane] += kernel.gain(residuals_sq[lane]);
        }
    }
    let Rest { source, target, is_pair } = &evidence.rest;
    let residuals_sq = pose.residuals_sq(source.each_ref(), target.each_ref());
    for lane in 0..LANES {
        let gain = kernel.gain(residuals_sq[lane]);
        own[lane] += if is_pair[lane] > 0.0 { gain } else { 0.0 };
    }
    *sums = own;
}

impl Evidence {
    /// Computes the squared distance between the moved source point and the target point of every pair into
    /// `residuals_sq`.
    pub fn residuals_sq(&self, target_from_source: &RigidTransform, residuals_sq: &mut Vec<f32>) {
        residuals_sq.clear();
        residuals_sq.resize(self.len(), 0.0);
        fill(&Motion::new(target_from_source), self, residuals_sq);
    }
}

/// Computes the squared residuals; compiled like the loop in [`total`], with the same bits.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn fill(pose: &Motion, evidence: &Evidence, residuals_sq: &mut [f32]) {
    let n = residuals_sq.len();
    let [px, py, pz] = &evidence.source;
    let [qx, qy, qz] = &evidence.target;
    let (px, py, pz) = (&px[..n], &py[..n], &pz[..n]);
    let (qx, qy, qz) = (&qx[..n], &qy[..n], &qz[..n]);
    for i in 0..n {
        residuals_sq[i] = pose.residual_sq([px[i], py[i], pz[i]], [qx[i], qy[i], qz[i]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Huber, InlierCount, Mse};
    use congruent_geometry::random::Stream;
    use nalgebra::{Translation3, Vector3};

    fn example(n: usize) -> (Evidence, RigidTransform) {
        let mut stream = Stream::new(1, n as u64);
        let pose = RigidTransform::from_parts(Translation3::new(3.0, -20.0, 7.0), stream.rotation());
        let pairs: Vec<_> = (0..n)
            .map(|_| {
                let p = Vector3::new(stream.normal(), stream.normal(), stream.normal()) * 50.0;
                let noise = Vector3::new(stream.normal(), stream.normal(), stream.normal()) * 5.0;
                let q = (pose * nalgebra::Point3::from(p)).coords + noise;
                (congruent_geometry::narrow(&p), congruent_geometry::narrow(&q))
            })
            .collect();
        (Evidence::new(pairs), pose)
    }

    #[test]
    fn the_blocked_sum_equals_the_plain_one() {
        for n in [0, 1, 31, 32, 33, 64, 500] {
            let (evidence, pose) = example(n);
            let kernel = Mse::new(7.5);
            let plain: f64 = (0..n).map(|i| f64::from(kernel.gain((evidence.residual(i, &pose) as f32).powi(2)))).sum();
            let blocked = Summed(kernel).score(&evidence, &pose).value();
            assert!((plain - blocked).abs() < 1e-3 * (1.0 + plain), "{n}: {plain} {blocked}");
        }
    }

    #[test]
    fn all_residuals_at_once_equal_those_one_by_one() {
        let (evidence, pose) = example(77);
        let mut residuals_sq = vec![1.0; 3];
        evidence.residuals_sq(&pose, &mut residuals_sq);
        assert_eq!(residuals_sq.len(), 77);
        for (i, residual_sq) in residuals_sq.iter().enumerate() {
            assert!((f64::from(*residual_sq).sqrt() - evidence.residual(i, &pose)).abs() < 1e-4);
        }
    }

    #[test]
    fn the_inlier_count_equals_the_list_of_inliers() {
        let (evidence, pose) = example(777);
        let counted = Summed(InlierCount::new(7.5)).score(&evidence, &pose).value();
        assert_eq!(counted, evidence.inliers(&pose, 7.5).len() as f64);
    }

    #[test]
    fn tighter_residuals_win_only_where_inliers_are_not_equal() {
        // Two poses with the same three inliers, one of them tighter.
        let evidence = Evidence::new([[0.0f32, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0, 30.0, 0.0]].map(|p| (p, p)));
        let shift = |by: f64| RigidTransform::translation(by, 0.0, 0.0);
        for by in [(1.0, 2.0), (0.0, 6.0)] {
            let score = |metric: &dyn Metric, by: f64| metric.score(&evidence, &shift(by));
            let t = 7.5;
            assert_eq!(score(&Summed(InlierCount::new(t)), by.0), score(&Summed(InlierCount::new(t)), by.1));
            for metric in crate::config::tests::one_of_each(t, 1.0) {
                assert!(score(metric.as_ref(), by.0) >= score(metric.as_ref(), by.1));
            }
            assert!(score(&Summed(Mse::new(t)), by.0) > score(&Summed(Mse::new(t)), by.1));
            assert!(score(&Summed(Huber::new(t)), by.0) > score(&Summed(Huber::new(t)), by.1));
        }
    }
}
