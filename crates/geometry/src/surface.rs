//! Points with everything that a detector or descriptor needs.

use crate::{NeighborIndex, Point};
use std::sync::Arc;

/// Points with unit normals, a neighbour index and the resolution; having one proves that they exist.
///
/// A normal may be zero if the neighbourhood has none (a line, an isolated point); everything that reads normals skips
/// those. Clones share the data.
#[derive(Clone)]
pub struct Surface {
    points: Arc<[Point]>,
    normals: Arc<[Point]>,
    index: Arc<NeighborIndex>,
    resolution: f64,
}

impl Surface {
    /// Assembles the parts.
    ///
    /// # Panics
    /// If the counts differ, or the resolution is not above zero.
    #[must_use]
    pub fn new(points: Vec<Point>, normals: Vec<Point>, index: NeighborIndex, resolution: f64) -> Self {
        assert!(
            points.len() == normals.len() && points.len() == index.len(),
            "points, normals and index belong together"
        );
        assert!(resolution > 0.0, "a resolution is a positive length");
        Surface { points: points.into(), normals: normals.into(), index: Arc::new(index), resolution }
    }

    /// Returns the centred points.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Returns the normals, of unit length or zero.
    #[must_use]
    pub fn normals(&self) -> &[Point] {
        &self.normals
    }

    /// Returns the same surface seen from its other side, with all normals reversed.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        self.normals = self.normals.iter().map(|normal| normal.map(|v| -v)).collect();
        self
    }

    /// Returns the index of the neighbours among [`Surface::points`].
    #[must_use]
    pub fn index(&self) -> &NeighborIndex {
        &self.index
    }

    /// Returns the mean distance to the nearest other point, data units.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}
