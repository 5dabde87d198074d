//! Where closest points come from.

use congruent_geometry::{NearestField, NeighborIndex, Point};

/// Finds the point of the fixed surface that is closest to a moved one.
pub trait Nearest: Sync {
    /// Its position, or `None` where nothing is in reach.
    fn nearest(&self, query: &Point) -> Option<u32>;
}

impl Nearest for NeighborIndex {
    fn nearest(&self, query: &Point) -> Option<u32> {
        NeighborIndex::nearest(self, query).map(|neighbor| neighbor.index)
    }
}

impl Nearest for NearestField {
    #[inline]
    fn nearest(&self, query: &Point) -> Option<u32> {
        NearestField::nearest(self, query)
    }
}
