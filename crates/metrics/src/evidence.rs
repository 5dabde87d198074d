//! The evidence by which hypotheses are judged: pairs of points that should coincide.

use congruent_geometry::{Point, RigidTransform, wide};
use nalgebra::{Matrix3, Vector3};

/// Number of pairs processed side by side.
pub(crate) const LANES: usize = 16;
/// Axes at least this far from orthonormal (norm of the difference to the identity) are not a frame.
const MAX_SKEW: f64 = 1e-3;

/// Corresponding points of source and target, ranked, best first, stored one coordinate at a time.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    pub(crate) source: [Vec<f32>; 3],
    pub(crate) target: [Vec<f32>; 3],
    pub(crate) rest: Rest,
    /// Unit normals at the two points, or zero; empty if none were given.
    normals: Vec<(Point, Point)>,
    /// Local reference frames at the two points; empty if none were given.
    frames: Vec<Option<(Matrix3<f64>, Matrix3<f64>)>>,
}

/// The pairs after the last whole register, with zeros in the other lanes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rest {
    pub(crate) source: [[f32; LANES]; 3],
    pub(crate) target: [[f32; LANES]; 3],
    /// One in each lane that has a pair.
    pub(crate) is_pair: [f32; LANES],
}

impl Evidence {
    /// Creates evidence from pairs `(source, target)` of centred points.
    pub fn new(pairs: impl IntoIterator<Item = (Point, Point)>) -> Self {
        let mut evidence = Evidence::default();
        for (p, q) in pairs {
            for axis in 0..3 {
                evidence.source[axis].push(p[axis]);
                evidence.target[axis].push(q[axis]);
            }
        }
        evidence.rest = Rest {
            source: evidence.source.each_ref().map(|axis| rest(axis)),
            target: evidence.target.each_ref().map(|axis| rest(axis)),
            is_pair: rest(&vec![1.0; evidence.len()]),
        };
        evidence
    }

    /// Adds the surface normals `(source, target)` at the points of each pair; zero where there is none.
    ///
    /// # Panics
    /// If there are not as many as pairs.
    #[must_use]
    pub fn with_normals(mut self, normals: Vec<(Point, Point)>) -> Self {
        assert_eq!(normals.len(), self.len(), "one pair of normals for each pair of points");
        self.normals = normals;
        self
    }

    /// Returns the unit normals at the points of pair `i`; `None` if either is unknown.
    #[must_use]
    pub fn normals(&self, i: usize) -> Option<(Point, Point)> {
        self.normals.get(i).copied().filter(|(p, q)| *p != [0.0; 3] && *q != [0.0; 3])
    }

    /// Adds the local reference frames `(source, target)` at the points of each pair: rotations with rows x, y, z,
    /// which map offsets from the point into the frame. What is not a rotation counts as missing.
    ///
    /// # Panics
    /// If there are not as many as pairs.
    #[must_use]
    pub fn with_frames(mut self, frames: Vec<Option<(Matrix3<f64>, Matrix3<f64>)>>) -> Self {
        assert_eq!(frames.len(), self.len(), "one pair of frames, or none, for each pair of points");
        self.frames = frames.into_iter().map(|pair| pair.filter(|(p, q)| is_rotation(p) && is_rotation(q))).collect();
        self
    }

    /// Returns the local reference frames at the points of pair `i`; `None` if either is unknown.
    #[must_use]
    pub fn frames(&self, i: usize) -> Option<(Matrix3<f64>, Matrix3<f64>)> {
        self.frames.get(i).copied().flatten()
    }

    /// Returns some of the pairs, in the order given.
    ///
    /// # Panics
    /// If there is no such pair.
    #[must_use]
    pub fn chosen(&self, pairs: &[usize]) -> Evidence {
        let at = |of: &[Vec<f32>; 3], i: usize| of.each_ref().map(|axis| axis[i]);
        let mut chosen = Evidence::new(pairs.iter().map(|&i| (at(&self.source, i), at(&self.target, i))));
        if !self.normals.is_empty() {
            chosen.normals = pairs.iter().map(|&i| self.normals[i]).collect();
        }
        if !self.frames.is_empty() {
            chosen.frames = pairs.iter().map(|&i| self.frames[i]).collect();
        }
        chosen
    }

    /// Returns the number of pairs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.source[0].len()
    }

    /// Returns whether there are no pairs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the source point of pair `i`.
    #[must_use]
    pub fn source(&self, i: usize) -> Vector3<f64> {
        wide(std::array::from_fn(|axis| self.source[axis][i]))
    }

    /// Returns the target point of pair `i`.
    #[must_use]
    pub fn target(&self, i: usize) -> Vector3<f64> {
        wide(std::array::from_fn(|axis| self.target[axis][i]))
    }

    /// Returns the distance between the moved source point and the target point of pair `i`.
    #[must_use]
    pub fn residual(&self, i: usize, target_from_source: &RigidTransform) -> f64 {
        (target_from_source * nalgebra::Point3::from(self.source(i)) - nalgebra::Point3::from(self.target(i))).norm()
    }

    /// Returns the pairs with a residual below `threshold`.
    #[must_use]
    pub fn inliers(&self, target_from_source: &RigidTransform, threshold: f64) -> Vec<usize> {
        (0..self.len()).filter(|&i| self.residual(i, target_from_source) < threshold).collect()
    }
}

fn is_rotation(axes: &Matrix3<f64>) -> bool {
    (axes * axes.transpose() - Matrix3::identity()).norm() < MAX_SKEW && axes.determinant() > 0.0
}

/// Returns what follows the last whole register, padded with zeros.
fn rest(axis: &[f32]) -> [f32; LANES] {
    let (_, rest) = axis.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    lanes[..rest.len()].copy_from_slice(rest);
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_no_rotations_are_missing() {
        let good = Matrix3::identity();
        let mirrored = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        let frames = vec![
            Some((good, good)),
            None,
            Some((good, mirrored)),
            Some((Matrix3::zeros(), good)),
            Some((good * f64::NAN, good)),
            Some((good * 1.1, good)),
        ];
        let evidence = Evidence::new(vec![([0.0; 3], [0.0; 3]); 6]);
        assert_eq!(evidence.frames(0), None);
        let evidence = evidence.with_frames(frames);
        assert_eq!(evidence.frames(0), Some((good, good)));
        assert!((1..7).all(|i| evidence.frames(i).is_none()));
    }
}
