//! Points that carry all a detector or descriptor needs.

use crate::{NeighborIndex, Point};
use std::sync::Arc;

/// Points with unit normals, a neighbour index and the resolution. Holding one proves that they exist.
///
/// A normal may be zero where the neighbourhood has none (a line, a lone point); everything that reads normals skips
/// those. A clone shares the parts.
#[derive(Clone)]
pub struct Surface {
    points: Arc<[Point]>,
    normals: Arc<[Point]>,
    index: Arc<NeighborIndex>,
    resolution: f64,
}

impl Surface {
    /// Puts the parts together.
    ///
    /// # Panics
    /// When they do not belong together: other counts, or a resolution that is not above zero.
    #[must_use]
    pub fn new(points: Vec<Point>, normals: Vec<Point>, index: NeighborIndex, resolution: f64) -> Self {
        assert!(
            points.len() == normals.len() && points.len() == index.len(),
            "points, normals and index belong together"
        );
        assert!(resolution > 0.0, "a resolution is a positive length");
        Surface { points: points.into(), normals: normals.into(), index: Arc::new(index), resolution }
    }

    /// Centred points.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Unit normals, or zero.
    #[must_use]
    pub fn normals(&self) -> &[Point] {
        &self.normals
    }

    /// The same surface seen from its other side.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        self.normals = self.normals.iter().map(|normal| normal.map(|v| -v)).collect();
        self
    }

    /// Neighbours among [`Surface::points`].
    #[must_use]
    pub fn index(&self) -> &NeighborIndex {
        &self.index
    }

    /// Mean distance to the nearest other point, data units.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}
