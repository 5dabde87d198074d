//! Where closest points come from.

use congruent_geometry::{NearestField, NeighborIndex, OrderedPoints, Point, Surface};

/// Cells of the grid that closest points are looked for in are so many times the resolution wide.
const CELL: f64 = 1.5;

/// Finds the point of the fixed surface that is closest to a moved one.
pub trait Nearest: Sync {
    /// Its position, or `None` where nothing is within `radius` (data units). What is found may be farther.
    fn nearest(&self, query: &Point, radius: f64) -> Option<u32>;
}

impl Nearest for NeighborIndex {
    fn nearest(&self, query: &Point, radius: f64) -> Option<u32> {
        self.nearest_within(query, radius).map(|neighbor| neighbor.index)
    }
}

impl Nearest for OrderedPoints {
    #[inline]
    fn nearest(&self, query: &Point, radius: f64) -> Option<u32> {
        self.nearest_within(query, radius).map(|neighbor| neighbor.index)
    }
}

impl Nearest for NearestField {
    #[inline]
    fn nearest(&self, query: &Point, _radius: f64) -> Option<u32> {
        NearestField::nearest(self, query)
    }
}

/// An exact search for the closest points of a surface.
pub(crate) enum Exact<'a> {
    Grid(OrderedPoints),
    Tree(&'a NeighborIndex),
}

impl<'a> Exact<'a> {
    pub(crate) fn of(surface: &'a Surface) -> Self {
        let ordered = OrderedPoints::unless_crowded(surface.points(), CELL * surface.resolution());
        ordered.map_or(Exact::Tree(surface.index()), Exact::Grid)
    }

    pub(crate) fn search(&self) -> &dyn Nearest {
        match self {
            Exact::Grid(ordered) => ordered,
            Exact::Tree(index) => *index,
        }
    }
}
