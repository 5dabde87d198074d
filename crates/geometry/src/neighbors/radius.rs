//! Neighbours within a fixed radius, queried at many positions.

use crate::{Neighbor, NeighborIndex, OrderedPoints, Point, Surface};

/// Number of cells along a radius.
const CELLS_PER_RADIUS: f64 = 2.0;

/// Finds all points within a fixed radius: in a grid, which is faster than a tree if all points are queried, or with
/// the tree if points are crowded.
pub struct RadiusSearch<'a> {
    index: &'a NeighborIndex,
    ordered: Option<OrderedPoints>,
    radius: f64,
}

impl<'a> RadiusSearch<'a> {
    /// Prepares a surface for searches with this radius (data units).
    #[must_use]
    pub fn new(surface: &'a Surface, radius: f64) -> Self {
        Self::among(surface.points(), surface.index(), radius)
    }

    /// Prepares points for searches where there is no surface yet.
    pub(crate) fn among(points: &[Point], index: &'a NeighborIndex, radius: f64) -> Self {
        RadiusSearch { index, ordered: OrderedPoints::unless_crowded(points, radius / CELLS_PER_RADIUS), radius }
    }

    /// Visits every point at most the radius away (inclusive), in an order that depends only on the cloud.
    #[inline]
    pub fn visit(&self, query: &Point, mut visit: impl FnMut(Neighbor)) {
        match &self.ordered {
            Some(ordered) => ordered.within(query, self.radius, |place, distance_sq| {
                visit(Neighbor { index: ordered.cells().order()[place], distance_sq });
            }),
            None => self.index.within(query, self.radius, visit),
        }
    }

    /// Finds the `k` nearest points within the radius, nearest first; in the grid, ties go to the lower index. `near`
    /// is overwritten.
    pub(crate) fn nearest_n(&self, query: &Point, k: usize, near: &mut Vec<Neighbor>) {
        near.clear();
        if self.ordered.is_none() {
            let limit = self.radius as f32 * self.radius as f32;
            near.extend(self.index.nearest_n(query, k).into_iter().filter(|n| n.distance_sq <= limit));
            return;
        }
        self.visit(query, |n| near.push(n));
        near.sort_unstable_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq).then(a.index.cmp(&b.index)));
        near.truncate(k);
    }

    /// Returns whether at least `count` points lie within the radius; in a grid, no more than that are counted.
    #[must_use]
    pub fn has(&self, query: &Point, count: usize) -> bool {
        match &self.ordered {
            Some(ordered) => ordered.has_within(query, self.radius, count),
            None => self.index.has_within(query, self.radius, count),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn grid_and_tree_find_the_same() {
        let mut stream = Stream::new(11, 0);
        let points: Vec<Point> = (0..500).map(|_| std::array::from_fn(|_| stream.unit() as f32)).collect();
        let index = NeighborIndex::new(&points);
        let surface = Surface::new(points.clone(), vec![[0.0, 0.0, 1.0]; 500], index, 0.1);
        for radius in [0.01, 0.2, 3.0] {
            let grid = RadiusSearch::new(&surface, radius);
            assert!(grid.ordered.is_some() || radius > 1.0);
            let tree = RadiusSearch { ordered: None, ..RadiusSearch::new(&surface, radius) };
            for point in points.iter().step_by(3) {
                let found = |search: &RadiusSearch<'_>| {
                    let mut found = Vec::new();
                    search.visit(point, |n| found.push((n.index, n.distance_sq.to_bits())));
                    found.sort_unstable();
                    found
                };
                let expected = found(&tree);
                assert_eq!(found(&grid), expected);
                for search in [&grid, &tree] {
                    assert!(search.has(point, expected.len()) && !search.has(point, expected.len() + 1));
                }
            }
        }
    }
}
