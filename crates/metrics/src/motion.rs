//! A pose in the form needed by loops over many points.

use congruent_geometry::{Point, RigidTransform};

/// A pose in `f32`, for many points.
pub(crate) struct Motion {
    pub(crate) linear: [Point; 3],
    pub(crate) shift: Point,
}

impl Motion {
    pub(crate) fn new(pose: &RigidTransform) -> Self {
        let rotation = pose.rotation.to_rotation_matrix();
        Motion {
            linear: std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)] as f32)),
            shift: congruent_geometry::narrow(&pose.translation.vector),
        }
    }

    pub(crate) fn turned(&self, v: &Point) -> Point {
        self.linear.each_ref().map(|row| dot(row, v))
    }

    pub(crate) fn moved(&self, p: &Point) -> Point {
        let turned = self.turned(p);
        std::array::from_fn(|axis| turned[axis] + self.shift[axis])
    }
}

pub(crate) fn dot(a: &Point, b: &Point) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
