//! Exact neighbour search.

use crate::Point;
use kiddo::leaf_strategy::FlatVec;
use kiddo::{Eytzinger, KdTree, SquaredEuclidean};
use std::num::NonZero;

/// Number of points in a leaf. Half as many would make building take 1.25 times as long and queries 1.3 times as fast;
/// since a grid answers wherever all points of a cloud are queried, few queries are left for the tree.
const LEAF: usize = 128;
type Tree = KdTree<f32, u32, Eytzinger, FlatVec<f32, u32, 3, LEAF>, 3, LEAF>;
type Squared = SquaredEuclidean<f32>;

/// Parts of the tree with at least this many points are built in parallel.
const SPLIT_FROM: usize = 4096;

/// A point found, identified by its position in the slice that the index was built from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor {
    /// Position in the indexed slice.
    pub index: u32,
    /// Squared distance to the query.
    pub distance_sq: f32,
}

/// A kd-tree over points. Immutable once built, and safe to share between threads.
///
/// The order of equally distant neighbours is unspecified, but is the same for the same points in the same order.
pub struct NeighborIndex {
    // `None` without points: an empty tree would return item 0 at infinite distance.
    tree: Option<Tree>,
    len: usize,
}

impl NeighborIndex {
    /// Indexes finite points; duplicates are allowed.
    ///
    /// # Panics
    /// With 2³² points or more.
    #[must_use]
    pub fn new(points: &[Point]) -> Self {
        assert!(u32::try_from(points.len()).is_ok(), "an index holds fewer than 2^32 points");
        let build = || Tree::builder().with_parallel_construction_threshold(SPLIT_FROM).build_from_slice(points);
        let tree = (!points.is_empty()).then(|| build().expect("finite points can be indexed"));
        NeighborIndex { tree, len: points.len() }
    }

    /// Returns the number of indexed points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there are no points to be found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the nearest point, including the query itself if it is one of the points; `None` for an empty index.
    #[must_use]
    pub fn nearest(&self, query: &Point) -> Option<Neighbor> {
        let hit = self.tree.as_ref()?.query(query).nearest_one::<Squared>().execute();
        Some(Neighbor { index: hit.item, distance_sq: hit.distance })
    }

    /// Returns the nearest point at most `radius` away (inclusive), including the query itself.
    #[must_use]
    pub fn nearest_within(&self, query: &Point, radius: f64) -> Option<Neighbor> {
        let radius = radius as f32;
        let nearest = self.tree.as_ref()?.query(query).nearest_n::<Squared>(NonZero::<usize>::MIN);
        let hits = nearest.within(radius * radius).execute();
        hits.first().map(|hit| Neighbor { index: hit.item, distance_sq: hit.distance })
    }

    /// Returns the `k` nearest points, nearest first; all of them if there are fewer.
    #[must_use]
    pub fn nearest_n(&self, query: &Point, k: usize) -> Vec<Neighbor> {
        let (Some(tree), Some(k)) = (self.tree.as_ref(), NonZero::new(k.min(self.len))) else { return Vec::new() };
        let hits = tree.query(query).nearest_n::<Squared>(k).execute();
        hits.iter().map(|hit| Neighbor { index: hit.item, distance_sq: hit.distance }).collect()
    }

    /// Visits every point at most `radius` away (inclusive), in no particular order.
    pub fn within(&self, query: &Point, radius: f64, mut visit: impl FnMut(Neighbor)) {
        let Some(tree) = self.tree.as_ref() else { return };
        let radius = radius as f32;
        tree.query(query)
            .within::<Squared>(radius * radius)
            .unsorted()
            .visit(|hit| visit(Neighbor { index: hit.item, distance_sq: hit.distance }));
    }

    /// Returns whether at least `count` points lie within `radius`.
    #[must_use]
    pub fn has_within(&self, query: &Point, radius: f64, count: usize) -> bool {
        let mut found = 0;
        self.within(query, radius, |_| found += 1);
        found >= count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    fn distance_sq(a: &Point, b: &Point) -> f32 {
        (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
    }

    /// A cloud with a planar half and duplicates, which are what breaks kd-trees.
    fn awkward_cloud() -> Vec<Point> {
        let mut stream = Stream::new(3, 0);
        let mut points: Vec<Point> = (0..600)
            .map(|i| [stream.unit() as f32, stream.unit() as f32, if i % 2 == 0 { 0.0 } else { stream.unit() as f32 }])
            .collect();
        points.extend_from_within(0..100);
        points
    }

    #[test]
    fn agrees_with_brute_force() {
        let points = awkward_cloud();
        let index = NeighborIndex::new(&points);
        for query in points.iter().step_by(7) {
            let mut all: Vec<f32> = points.iter().map(|p| distance_sq(p, query)).collect();
            let radius = 0.2f64;
            let expected = all.iter().filter(|&&d| d <= (radius as f32) * (radius as f32)).count();
            let mut found = 0;
            index.within(query, radius, |hit| {
                assert_eq!(hit.distance_sq, distance_sq(&points[hit.index as usize], query));
                found += 1;
            });
            assert_eq!(found, expected);
            assert!(index.has_within(query, radius, expected) && !index.has_within(query, radius, expected + 1));
            all.sort_by(f32::total_cmp);
            let nearest: Vec<f32> = index.nearest_n(query, 12).iter().map(|n| n.distance_sq).collect();
            assert_eq!(nearest, all[..12]);
            assert_eq!(index.nearest(query).unwrap().distance_sq, 0.0);
            let beside = query.map(|v| v + 0.05);
            let nearest = index.nearest(&beside);
            let rim = f64::from(nearest.unwrap().distance_sq.sqrt());
            assert_eq!(
                index.nearest_within(&beside, 1.001 * rim).map(|n| n.distance_sq),
                nearest.map(|n| n.distance_sq)
            );
            assert_eq!(index.nearest_within(&beside, 0.999 * rim), None);
        }
    }

    #[test]
    fn few_points_answer_what_they_can() {
        let empty = NeighborIndex::new(&[]);
        assert!(empty.nearest(&[0.0; 3]).is_none() && empty.nearest_n(&[0.0; 3], 3).is_empty() && empty.is_empty());
        let two = NeighborIndex::new(&[[0.0; 3], [1.0, 0.0, 0.0]]);
        assert_eq!(two.nearest_n(&[0.0; 3], 9).len(), 2);
        assert_eq!(two.nearest_n(&[0.0; 3], 0).len(), 0);
    }
}
