//! Which points touch under a pose.

use crate::Nearest;
use congruent_geometry::{LastSeen, RigidTransform, Surface, narrow, wide};
use nalgebra::{Matrix3, Vector3};

/// Points whose closest points are looked up together.
const BLOCK: usize = 64;

/// A point of the moved source and what it touches; target frame.
pub(crate) struct Touch {
    pub(crate) moved: Vector3<f64>,
    /// From the touched point.
    pub(crate) offset: Vector3<f64>,
    /// There.
    pub(crate) normal: Vector3<f64>,
    /// Of the moved point.
    pub(crate) turned: Vector3<f64>,
    /// Between the two.
    pub(crate) cosine: f64,
    /// To the tangent plane, signed.
    pub(crate) distance: f64,
    /// Robust (Cauchy).
    pub(crate) weight: f64,
}

/// A source on its way to a target.
pub(crate) struct Pairing<'a> {
    source: &'a Surface,
    target: &'a Surface,
    nearest: &'a dyn Nearest,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    radius: f64,
    min_normal_cosine: f64,
    scale_sq: f64,
}

impl<'a> Pairing<'a> {
    pub(crate) fn new(
        (source, target, nearest): (&'a Surface, &'a Surface, &'a dyn Nearest),
        pose: &RigidTransform,
        radius: f64,
        min_normal_cosine: f64,
        scale: f64,
    ) -> Self {
        Pairing {
            source,
            target,
            nearest,
            rotation: *pose.rotation.to_rotation_matrix().matrix(),
            shift: pose.translation.vector,
            radius,
            min_normal_cosine,
            scale_sq: scale * scale,
        }
    }

    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// Visits what some points of the source touch, in their order. `last` is what each of them has seen under the pose before.
    pub(crate) fn each_touch(&self, points: &[usize], last: &mut [LastSeen], mut visit: impl FnMut(Touch)) {
        let (mut moved, mut queries, mut found) = ([Vector3::zeros(); BLOCK], [[0.0; 3]; BLOCK], [None; BLOCK]);
        for (points, last) in points.chunks(BLOCK).zip(last.chunks_mut(BLOCK)) {
            let n = points.len();
            for ((&i, moved), query) in points.iter().zip(&mut moved).zip(&mut queries) {
                *moved = self.rotation * wide(self.source.points()[i]) + self.shift;
                *query = narrow(moved);
            }
            self.nearest.nearest_each(&queries[..n], self.radius, last, &mut found[..n]);
            for ((&i, moved), found) in points.iter().zip(&moved).zip(&found) {
                found.and_then(|found| self.touch(i, moved, found as usize)).into_iter().for_each(&mut visit);
            }
        }
    }

    /// Between a point of the source, moved, and one of the target.
    #[inline]
    fn touch(&self, i: usize, &moved: &Vector3<f64>, found: usize) -> Option<Touch> {
        let offset = moved - wide(self.target.points()[found]);
        let normal = wide(self.target.normals()[found]);
        let turned = self.rotation * wide(self.source.normals()[i]);
        let cosine = turned.dot(&normal);
        // Written so that a NaN is refused.
        if !(offset.norm_squared() <= self.radius * self.radius && cosine >= self.min_normal_cosine) {
            return None;
        }
        let distance = offset.dot(&normal);
        let weight = 1.0 / (1.0 + distance * distance / self.scale_sq);
        Some(Touch { moved, offset, normal, turned, cosine, distance, weight })
    }
}
