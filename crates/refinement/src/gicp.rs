//! Generalized ICP (Segal, Haehnel and Thrun 2009): each point is a small disc, and discs are aligned with discs.
//!
//! A point's covariance has the eigenvalue 1 along its surface and ε along its normal, so with unit normals *n*
//! (target) and *m* (source, rotated), *c* = *n·m*, the metric `(C_t + R C_s Rᵀ)⁻¹` is
//! `½I + a(n+m)(n+m)ᵀ + b(n−m)(n−m)ᵀ` with `a, b = (1−ε) / (4(2 − (1−ε)(1±c)))`: no matrix needs to be inverted.

use crate::descent::{Distance, Scene};
use crate::equations::Equations;
use crate::nearest::Exact;
use crate::touches::{BLOCK, Column, Touches};
use crate::{Freedom, Refinement, Refiner, Schedule};
use congruent_geometry::{RigidTransform, Surface};
use multiversion::multiversion;

/// Disc-to-disc ICP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gicp {
    /// How far it searches, and how long.
    pub schedule: Schedule,
    /// ε: variance along the normal relative to a variance of one along the surface.
    pub flatness: f64,
}

impl Gicp {
    /// Restricts the refiner to the allowed motions.
    #[must_use]
    pub fn within(mut self, freedom: Freedom) -> Self {
        self.schedule.freedom = freedom;
        self
    }
}

impl Refiner for Gicp {
    fn refine(&self, source: &Surface, target: &Surface, start: &RigidTransform) -> Refinement {
        let exact = Exact::of(target);
        let scene = Scene { source, target, nearest: exact.search() };
        self.schedule.refine(scene, &Discs { flatness: self.flatness }, start)
    }
}

struct Discs {
    flatness: f64,
}

impl Distance for Discs {
    const UNSEEN: f64 = 1.4;

    fn add(&self, equations: &mut Equations, touches: &Touches) {
        let mut metric = [[0.0; BLOCK]; 6];
        metrics(touches, self.flatness, &mut metric);
        equations.add_metric(touches, &metric);
    }
}

/// Computes `2ε (C_t + R C_s Rᵀ)⁻¹` of each pair, its rows up to the diagonal: squared distances along a shared normal
/// are unchanged. Compiled for several instruction sets and chosen at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn metrics(touches: &Touches, flatness: f64, metric: &mut [Column; 6]) {
    let thin = 1.0 - flatness;
    let (n, m) = (&touches.normal, &touches.turned);
    for k in 0..BLOCK {
        let cosine = touches.cosine[k];
        let a = thin / (4.0 * (2.0 - thin * (1.0 + cosine)));
        let b = thin / (4.0 * (2.0 - thin * (1.0 - cosine)));
        let sum = [n[0][k] + m[0][k], n[1][k] + m[1][k], n[2][k] + m[2][k]];
        let difference = [n[0][k] - m[0][k], n[1][k] - m[1][k], n[2][k] - m[2][k]];
        let mut entry = 0;
        for i in 0..3 {
            for j in 0..=i {
                let along = if i == j { 0.5 } else { 0.0 };
                let outer = a * sum[i] * sum[j] + b * difference[i] * difference[j];
                metric[entry][k] = (along + outer) * (2.0 * flatness);
                entry += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn the_metric_is_the_inverse_of_the_summed_covariances() {
        let mut stream = Stream::new(3, 0);
        let flatness = 10f64.powf(stream.between(-4.0, -0.1));
        let normals: Vec<[Vector3<f64>; 2]> =
            (0..BLOCK).map(|_| [stream.rotation() * Vector3::z(), stream.rotation() * Vector3::z()]).collect();
        let column = |of: &dyn Fn(&[Vector3<f64>; 2]) -> f64| -> Column { std::array::from_fn(|k| of(&normals[k])) };
        let touches = Touches {
            normal: [0, 1, 2].map(|axis| column(&|pair| pair[0][axis])),
            turned: [0, 1, 2].map(|axis| column(&|pair| pair[1][axis])),
            cosine: column(&|pair| pair[0].dot(&pair[1])),
            ..Touches::default()
        };
        let mut metric = [[0.0; BLOCK]; 6];
        metrics(&touches, flatness, &mut metric);
        for (k, [n, m]) in normals.iter().enumerate() {
            let covariance = |v: &Vector3<f64>| Matrix3::identity() - v * v.transpose() * (1.0 - flatness);
            let expected = (covariance(n) + covariance(m)).try_inverse().unwrap() * (2.0 * flatness);
            let [xx, xy, yy, xz, yz, zz] = metric.map(|entry| entry[k]);
            let found = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            assert!((found - expected).norm() < 1e-9 * expected.norm());
        }
    }
}
