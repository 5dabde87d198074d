//! The points that touch under a pose.

use crate::Nearest;
use crate::touches::{BLOCK, Ends, Limits, Touches, Vectors, place_each};
use congruent_geometry::{LastSeen, Point, RigidTransform, Surface};
use nalgebra::{Matrix3, Vector3};

/// Every `step`-th point of a cloud.
#[derive(Clone, Copy)]
pub(crate) struct Every {
    first: usize,
    step: usize,
    pub(crate) count: usize,
}

impl Every {
    /// Takes points from position `first` of `n` points on.
    pub(crate) fn new(n: usize, first: usize, step: usize) -> Self {
        Every { first, step, count: n.saturating_sub(first).div_ceil(step) }
    }

    /// Splits the points into parts of at most `size`.
    pub(crate) fn chunks(self, size: usize) -> impl Iterator<Item = Every> {
        let Every { first, step, count } = self;
        (0..count).step_by(size).map(move |k| Every { first: first + k * step, step, count: size.min(count - k) })
    }

    fn positions(self) -> impl Iterator<Item = usize> {
        (0..self.count).map(move |k| self.first + k * self.step)
    }
}

/// A source moved towards a target.
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

    /// Visits what some points of the source touch, in their order, many at a time. `last` is what each of them saw
    /// under the previous pose; empty if the search does not remember it.
    pub(crate) fn each_touch(&self, points: Every, last: &mut [LastSeen], mut visit: impl FnMut(&Touches)) {
        let (mut places, mut moved) = ([[0.0; BLOCK]; 3], [[0.0; BLOCK]; 3]);
        let (mut queries, mut found) = ([[0.0; 3]; BLOCK], [None; BLOCK]);
        let (mut ends, mut touches) = (Ends::default(), Touches::default());
        let mut last = last.chunks_mut(BLOCK);
        for points in points.chunks(BLOCK) {
            let (n, last) = (points.count, last.next().unwrap_or_default());
            points.positions().enumerate().for_each(|(k, i)| put(&mut places, k, &self.source.points()[i]));
            place_each(&places, self.rotation.as_ref(), self.shift.as_ref(), &mut moved);
            queries.iter_mut().enumerate().for_each(|(k, query)| *query = [0, 1, 2].map(|axis| moved[axis][k] as f32));
            self.nearest.nearest_each(&queries[..n], self.radius, last, &mut found[..n]);
            self.collect(points, &moved, &found, &mut ends);
            if ends.n > 0 {
                touches.see(&ends, &self.rotation, self.limits());
                visit(&touches);
            }
        }
    }

    /// Collects the pairs whose search found something.
    fn collect(&self, points: Every, moved: &Vectors, found: &[Option<u32>; BLOCK], ends: &mut Ends) {
        ends.n = 0;
        for (k, i) in points.positions().enumerate() {
            let Some(found) = found[k].map(|found| found as usize) else { continue };
            (0..3).for_each(|axis| ends.moved[axis][ends.n] = moved[axis][k]);
            put(&mut ends.source_normal, ends.n, &self.source.normals()[i]);
            put(&mut ends.target, ends.n, &self.target.points()[found]);
            put(&mut ends.target_normal, ends.n, &self.target.normals()[found]);
            ends.n += 1;
        }
    }

    fn limits(&self) -> Limits {
        let (radius_sq, scale_sq) = (self.radius * self.radius, self.scale_sq);
        Limits { radius_sq, scale_sq, min_normal_cosine: self.min_normal_cosine }
    }
}

#[inline]
fn put(vectors: &mut Vectors, k: usize, point: &Point) {
    (0..3).for_each(|axis| vectors[axis][k] = f64::from(point[axis]));
}
