//! The nearest point of a cloud within a reach, looked up in a table.
//!
//! Most hypotheses bring most points nowhere near the target, and many hypotheses query the same places. A table of the
//! places that are near, each with the few points that can be the nearest there, answers exactly, and at a fraction of
//! the cost of a search.

use super::grid::Grid;
use super::ordered::distance_sq;
use crate::Point;
use std::ops::Range;

/// Maximum number of cells, since more would cost more than they save; beyond it the cells grow.
const MAX_CELLS: f64 = 4e6;
/// Number of cells along the reach.
const FINENESS: f64 = 2.0;
/// Margin around a cell (in cells) out of which rounding must not move its points: this much …
const MARGIN: f64 = 1e-3;
/// … plus this much per cell along the longest side.
const MARGIN_PER_CELL: f64 = 1e-6;

/// Points are crowded if the cell of a candidate holds more than this many candidates on average.
const MAX_CROWDING: f64 = 200.0;
/// Number of queries processed side by side.
const BLOCK: usize = 64;

/// The cells that hold all places within reach of a cloud, with the points that can be the nearest in each.
pub struct NearestTable {
    grid: Grid,
    /// Start of the candidates of each cell; those of the next cell follow.
    starts: Vec<u32>,
    candidates: Vec<Point>,
}

impl NearestTable {
    /// Builds a table around points, as far as `reach` (data units).
    ///
    /// Returns `None` if there are no points, if `reach` is not a positive finite number, or if points are so crowded
    /// that a tree finds the nearest sooner.
    #[must_use]
    pub fn new(points: &[Point], reach: f64) -> Option<NearestTable> {
        if points.is_empty() || !(reach.is_finite() && reach > 0.0) {
            return None;
        }
        let grid = Grid::around(points, reach / FINENESS, 2.0 * reach, MAX_CELLS);
        let bounds = bounds(&grid, points, reach);
        let counts = count(&grid, points, reach, &bounds);
        if crowding(&counts) > MAX_CROWDING {
            return None;
        }
        let mut next = 0;
        let mut starts = Vec::with_capacity(counts.len() + 1);
        for count in counts {
            starts.push(next);
            next += count;
        }
        starts.push(next);
        let mut free = starts.clone();
        let mut candidates = vec![[0.0; 3]; next as usize];
        for point in points {
            each_near(&grid, point, reach, |place, nearest, _| {
                if nearest <= bounds[place] {
                    candidates[free[place] as usize] = *point;
                    free[place] += 1;
                }
            });
        }
        Some(NearestTable { grid, starts, candidates })
    }

    /// Visits the squared distance from each query to its nearest point, in order; a query without a point within reach
    /// is skipped, or yields the distance to a point slightly farther away.
    #[inline]
    pub fn each_nearest_sq(&self, queries: impl Iterator<Item = Point>, mut visit: impl FnMut(f32)) {
        // The cells of many queries are computed before the first is searched: memory is slow, but serves many requests
        // at a time.
        let mut queries = queries.peekable();
        let mut near: [(Range<u32>, Point); BLOCK] = std::array::from_fn(|_| (0..0, [0.0; 3]));
        while queries.peek().is_some() {
            let mut n = 0;
            for query in queries.by_ref().take(BLOCK) {
                let place = cell_of(&self.grid, &query).unwrap_or(self.starts.len() - 2);
                near[n] = (self.starts[place]..self.starts[place + 1], query);
                n += usize::from(!near[n].0.is_empty());
            }
            for (candidates, query) in &near[..n] {
                let candidates = &self.candidates[candidates.start as usize..candidates.end as usize];
                visit(candidates.iter().fold(f32::INFINITY, |nearest, point| nearest.min(distance_sq(point, query))));
            }
        }
    }
}

/// Returns, for each cell, a squared distance within which every place in it has a point.
fn bounds(grid: &Grid, points: &[Point], reach: f64) -> Vec<f32> {
    let mut bounds = vec![f32::INFINITY; grid.n_cells()];
    for point in points {
        each_near(grid, point, reach, |place, _, farthest| bounds[place] = bounds[place].min(farthest));
    }
    bounds
}

/// Counts the points that can be the nearest in each cell.
fn count(grid: &Grid, points: &[Point], reach: f64, bounds: &[f32]) -> Vec<u32> {
    let mut counts = vec![0; bounds.len()];
    for point in points {
        each_near(grid, point, reach, |place, nearest, _| counts[place] += u32::from(nearest <= bounds[place]));
    }
    counts
}

/// Visits every cell with a place within `reach` of a point, with the squared distances of its nearest and its farthest
/// place; the first is slightly underestimated, the second slightly overestimated.
fn each_near(grid: &Grid, point: &Point, reach: f64, mut visit: impl FnMut(usize, f32, f32)) {
    let Some(cells) = coordinates(grid, point) else { return };
    let side = f64::from(grid.side);
    let margin = side * (MARGIN + MARGIN_PER_CELL * grid.size.into_iter().max().unwrap_or(0) as f64);
    let steps = (reach / side).ceil() as usize + 1;
    let along: [Range<usize>; 3] =
        std::array::from_fn(|axis| cells[axis].saturating_sub(steps)..(cells[axis] + steps + 1).min(grid.size[axis]));
    let limit = ((reach + margin) * (reach + margin)) as f32;
    let gaps = |axis: usize, cell: usize| {
        let low = f64::from(grid.low[axis]) + cell as f64 * side - f64::from(point[axis]) - margin;
        let high = low + side + 2.0 * margin;
        let near = low.max(-high).max(0.0);
        let far = high.max(-low);
        ((near * near) as f32, (far * far) as f32)
    };
    for z in along[2].clone() {
        let (near_z, far_z) = gaps(2, z);
        for y in along[1].clone() {
            let (near_y, far_y) = gaps(1, y);
            for x in along[0].clone() {
                let (near_x, far_x) = gaps(0, x);
                let near = near_x + near_y + near_z;
                if near <= limit {
                    visit(grid.number([x, y, z]), near, far_x + far_y + far_z);
                }
            }
        }
    }
}

#[inline]
fn cell_of(grid: &Grid, point: &Point) -> Option<usize> {
    coordinates(grid, point).map(|cell| grid.number(cell))
}

#[inline]
fn coordinates(grid: &Grid, point: &Point) -> Option<[usize; 3]> {
    let place = grid.place(point);
    let inside = (0..3).all(|axis| place[axis] >= 0.0 && place[axis] < grid.size[axis] as f32);
    inside.then(|| place.map(|v| v as usize))
}

/// Returns the mean number of candidates in the cell of a candidate, which determines how long a lookup takes.
fn crowding(counts: &[u32]) -> f64 {
    let all: f64 = counts.iter().map(|&n| f64::from(n)).sum();
    counts.iter().map(|&n| f64::from(n).powi(2)).sum::<f64>() / all.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NeighborIndex;
    use crate::random::Stream;

    fn scatter(n: usize, half: f64, seed: u64) -> Vec<Point> {
        let mut stream = Stream::new(seed, 0);
        (0..n).map(|_| std::array::from_fn(|_| stream.between(-half, half) as f32)).collect()
    }

    impl NearestTable {
        fn nearest_sq(&self, query: &Point) -> Option<f32> {
            let mut found = None;
            self.each_nearest_sq(std::iter::once(*query), |d| found = Some(d));
            found
        }
    }

    #[test]
    fn the_nearest_within_reach_is_found_and_most_of_the_others_are_spared() {
        for n in [1, 40, 150] {
            let cloud = scatter(n, 50.0, 1);
            let index = NeighborIndex::new(&cloud);
            for reach in [0.001, 3.0, 11.0, 400.0] {
                let table = NearestTable::new(&cloud, reach).unwrap();
                for query in scatter(20_000, 80.0, 2).iter().chain(&cloud) {
                    let nearest = index.nearest(query).unwrap().distance_sq;
                    let found = table.nearest_sq(query);
                    let within = f64::from(nearest).sqrt() <= reach;
                    assert!(found == Some(nearest) || (!within && found.is_none_or(|d| d >= nearest)), "{reach}");
                }
            }
        }
        let cloud = scatter(40, 50.0, 1);
        let table = NearestTable::new(&cloud, 3.0).unwrap();
        let queries = scatter(20_000, 80.0, 2);
        let one_by_one: Vec<f32> = queries.iter().filter_map(|q| table.nearest_sq(q)).collect();
        let mut at_once = Vec::new();
        table.each_nearest_sq(queries.into_iter(), |d| at_once.push(d));
        assert_eq!(at_once, one_by_one);
        assert!((20..1500).contains(&at_once.len()), "{}", at_once.len());
    }

    #[test]
    fn a_long_cloud_and_a_lone_point_far_away_are_no_trouble() {
        let mut cloud: Vec<Point> = (0..2000).map(|i| [50.0 * i as f32, 0.0, 0.0]).collect();
        cloud.push([0.0, 3e5, 1e5]);
        let index = NeighborIndex::new(&cloud);
        let table = NearestTable::new(&cloud, 2.0).unwrap();
        for (point, offset) in cloud.iter().zip(scatter(2001, 1.0, 3)) {
            let query: Point = std::array::from_fn(|axis| point[axis] + offset[axis]);
            assert_eq!(table.nearest_sq(&query), index.nearest(&query).map(|n| n.distance_sq));
        }
    }

    #[test]
    fn a_crowd_is_left_to_a_tree() {
        let mut cloud = scatter(500, 50.0, 1);
        assert!(NearestTable::new(&cloud, 5.0).is_some());
        cloud.extend(scatter(3000, 1e-3, 2));
        assert!(NearestTable::new(&cloud, 5.0).is_none());
    }

    #[test]
    fn without_points_or_reach_there_is_no_table() {
        assert!(NearestTable::new(&[], 1.0).is_none());
        for reach in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(NearestTable::new(&[[0.0; 3]], reach).is_none());
        }
        // A cloud of zero extent.
        let table = NearestTable::new(&[[5.0; 3]; 3], 1.0).unwrap();
        assert_eq!(table.nearest_sq(&[5.0; 3]), Some(0.0));
        assert_eq!(table.nearest_sq(&[f32::NAN; 3]), None);
    }
}
