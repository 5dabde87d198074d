//! The search for closest points.

use congruent_geometry::{LastSeen, NearestField, NeighborIndex, OrderedPoints, Point, Surface};

/// Width of the cells of the grid in which closest points are searched, in multiples of the resolution.
const CELL: f64 = 1.5;

/// Finds the points of the fixed surface that are closest to moved points.
pub trait Nearest: Sync {
    /// Finds their positions, or `None` if nothing is within `radius` (data units). A point found may be farther away.
    ///
    /// `last` is what each of the points saw under the previous pose; it is empty for a search that does not remember.
    /// All other slices have the same length.
    fn nearest_each(&self, queries: &[Point], radius: f64, last: &mut [LastSeen], found: &mut [Option<u32>]);

    /// Returns whether remembering what points saw saves searches.
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
