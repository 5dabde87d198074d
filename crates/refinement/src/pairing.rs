//! Which points touch under a pose.

use crate::Nearest;
use congruent_geometry::{RigidTransform, Surface, narrow, wide};
use nalgebra::{Matrix3, Vector3};

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
    pub(crate) source: &'a Surface,
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

    /// What point `i` of the source touches, if anything.
    #[inline]
    pub(crate) fn touch(&self, i: usize) -> Option<Touch> {
        let moved = self.rotation * wide(self.source.points()[i]) + self.shift;
        let found = self.nearest.nearest(&narrow(&moved), self.radius)? as usize;
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
