//! Generalized ICP (Segal, Haehnel and Thrun 2009): each point is a little disc, and discs are laid on discs.
//!
//! A point's covariance has the eigenvalue 1 along its surface and ε along its normal, so with unit normals *n* (target)
//! and *m* (source, turned), *c* = *n·m*, the metric `(C_t + R C_s Rᵀ)⁻¹` is
//! `½I + a(n+m)(n+m)ᵀ + b(n−m)(n−m)ᵀ` with `a, b = (1−ε) / (4(2 − (1−ε)(1±c)))`: no matrix need be inverted.

use crate::descent::{Distance, Scene};
use crate::equations::Equations;
use crate::nearest::Exact;
use crate::pairing::Touch;
use crate::{Freedom, Refinement, Refiner, Schedule};
use congruent_geometry::{RigidTransform, Surface};
use nalgebra::{Matrix3, Vector3};

/// Disc-to-disc ICP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gicp {
    /// How far it looks, and how long.
    pub schedule: Schedule,
    /// ε: variance along the normal for a variance of one along the surface.
    pub flatness: f64,
}

impl Gicp {
    /// The same with the allowed motions only.
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

    #[inline]
    fn add(&self, equations: &mut Equations, touch: &Touch) {
        equations.add_metric(touch, &metric(&touch.normal, &touch.turned, self.flatness));
    }
}

/// `2ε (C_t + R C_s Rᵀ)⁻¹`: squared distances along a shared normal count as they are.
fn metric(n: &Vector3<f64>, m: &Vector3<f64>, flatness: f64) -> Matrix3<f64> {
    let (thin, cosine) = (1.0 - flatness, n.dot(m));
    let (sum, difference) = (n + m, n - m);
    let outer = |v: &Vector3<f64>, cosine: f64| v * v.transpose() * (thin / (4.0 * (2.0 - thin * (1.0 + cosine))));
    (Matrix3::identity() * 0.5 + outer(&sum, cosine) + outer(&difference, -cosine)) * (2.0 * flatness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    #[test]
    fn the_metric_is_the_inverse_of_the_summed_covariances() {
        let mut stream = Stream::new(3, 0);
        for _ in 0..50 {
            let (n, m) = (stream.rotation() * Vector3::z(), stream.rotation() * Vector3::z());
            let flatness = 10f64.powf(stream.between(-4.0, -0.1));
            let covariance = |v: &Vector3<f64>| Matrix3::identity() - v * v.transpose() * (1.0 - flatness);
            let expected = (covariance(&n) + covariance(&m)).try_inverse().unwrap() * (2.0 * flatness);
            assert!((metric(&n, &m, flatness) - expected).norm() < 1e-9 * expected.norm());
        }
    }
}
