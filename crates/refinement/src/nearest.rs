//! Where closest points come from.

use congruent_geometry::{LastSeen, NearestField, NeighborIndex, OrderedPoints, Point, Surface};

/// Cells of the grid that closest points are looked for in are so many times the resolution wide.
const CELL: f64 = 1.5;

/// Finds the points of the fixed surface that are closest to moved ones.
pub trait Nearest: Sync {
    /// Their positions, or `None` where nothing is within `radius` (data units). What is found may be farther.
    ///
    /// `last` is what each of the points has seen under the pose before; it is empty for a search that does not remember. All
    /// other slices are equally long.
    fn nearest_each(&self, queries: &[Point], radius: f64, last: &mut [LastSeen], found: &mut [Option<u32>]);

    /// Whether what points have seen spares a search.
    fn remembers(&self) -> bool {
        false
    }
}

impl Nearest for NeighborIndex {
    fn nearest_each(&self, queries: &[Point], radius: f64, _last: &mut [LastSeen], found: &mut [Option<u32>]) {
        for (query, found) in queries.iter().zip(found) {
            *found = self.nearest_within(query, radius).map(|neighbor| neighbor.index);
        }
    }
}

impl Nearest for OrderedPoints {
    fn nearest_each(&self, queries: &[Point], radius: f64, last: &mut [LastSeen], found: &mut [Option<u32>]) {
        for ((query, last), found) in queries.iter().zip(last).zip(found) {
            *found = self.nearest_following(query, radius, last);
        }
    }

    fn remembers(&self) -> bool {
        true
    }
}

impl Nearest for NearestField {
    fn nearest_each(&self, queries: &[Point], _radius: f64, _last: &mut [LastSeen], found: &mut [Option<u32>]) {
        NearestField::nearest_each(self, queries, found);
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
