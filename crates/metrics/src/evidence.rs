//! What hypotheses are judged by: pairs of points that should fall together.

use congruent_geometry::{Point, RigidTransform, wide};
use nalgebra::Vector3;

/// Corresponding points of source and target, ranked, best first, stored a coordinate at a time.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    pub(crate) source: [Vec<f32>; 3],
    pub(crate) target: [Vec<f32>; 3],
    /// Unit normals at the two points, or zero; empty where nobody gave any.
    normals: Vec<(Point, Point)>,
}

impl Evidence {
    /// From pairs `(source, target)` of centred points.
    pub fn new(pairs: impl IntoIterator<Item = (Point, Point)>) -> Self {
        let mut evidence = Evidence::default();
        for (p, q) in pairs {
            for axis in 0..3 {
                evidence.source[axis].push(p[axis]);
                evidence.target[axis].push(q[axis]);
            }
        }
        evidence
    }

    /// Adds the surface normals `(source, target)` at the points of each pair; zero where there is none.
    ///
    /// # Panics
    /// When they are not as many as the pairs.
    #[must_use]
    pub fn with_normals(mut self, normals: Vec<(Point, Point)>) -> Self {
        assert_eq!(normals.len(), self.len(), "one pair of normals for each pair of points");
        self.normals = normals;
        self
    }

    /// Unit normals at the points of pair `i`; `None` where either is unknown.
    #[must_use]
    pub fn normals(&self, i: usize) -> Option<(Point, Point)> {
        self.normals.get(i).copied().filter(|(p, q)| *p != [0.0; 3] && *q != [0.0; 3])
    }

    /// How many pairs there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.source[0].len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Source point of pair `i`.
    #[must_use]
    pub fn source(&self, i: usize) -> Vector3<f64> {
        wide(std::array::from_fn(|axis| self.source[axis][i]))
    }

    /// Target point of pair `i`.
    #[must_use]
    pub fn target(&self, i: usize) -> Vector3<f64> {
        wide(std::array::from_fn(|axis| self.target[axis][i]))
    }

    /// Distance between the moved source point and the target point of pair `i`.
    #[must_use]
    pub fn residual(&self, i: usize, target_from_source: &RigidTransform) -> f64 {
        (target_from_source * nalgebra::Point3::from(self.source(i)) - nalgebra::Point3::from(self.target(i))).norm()
    }

    /// The pairs with a residual below `threshold`.
    #[must_use]
    pub fn inliers(&self, target_from_source: &RigidTransform, threshold: f64) -> Vec<usize> {
        (0..self.len()).filter(|&i| self.residual(i, target_from_source) < threshold).collect()
    }
}
