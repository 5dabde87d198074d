//! The resolution of a cloud, `pr`: the length in which all other lengths are measured.

use crate::neighbors::blocks::{Block, LANES};
use crate::neighbors::{lesser, nearest_others};
use crate::random::Stream;
use crate::view::Spaced;
use crate::{Neighbor, NeighborIndex, OrderedPoints, Point, Scanner, wide};
use multiversion::multiversion;
use rayon::prelude::*;

/// Clouds of up to this many points are measured at every point.
const EXACT_UP_TO: usize = 200_000;
/// Larger clouds are measured at this many points, drawn uniformly.
const SAMPLED_AT: usize = 50_000;
/// A point farther than this many medians from all others is lonely, …
const LONELY: f64 = 3.0;
/// … and farther than this many medians it is not part of the surface: a single such point must not dominate the mean.
const ALONE: f64 = 100.0;

/// Mean distance from a point to its nearest other point. Points more than a hundred medians away from all others do
/// not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// In data units.
    pub mean: f64,
    /// Median of the same distances, data units.
    pub median: f64,
    /// Fraction of the points whose nearest other point is farther than three medians.
    pub lonely: f64,
    /// Standard error of the mean; zero if every point was measured.
    pub standard_error: f64,
}

/// Measures a cloud of at least two distinct points; returns `None` for fewer.
///
/// Exact duplicates would count as distance zero and lower the mean, so they must be removed beforehand. Above 200 000
/// points, 50 000 of them are queried (against the whole cloud).
#[must_use]
pub fn resolution(points: &[Point], index: &NeighborIndex) -> Option<Resolution> {
    resolution_at(points, index, if points.len() <= EXACT_UP_TO { points.len() } else { SAMPLED_AT })
}

/// Measures a cloud at `queries` points drawn uniformly (at all of them if there are no more).
#[must_use]
pub fn resolution_at(points: &[Point], index: &NeighborIndex, queries: usize) -> Option<Resolution> {
    let asked = drawn(points.len(), queries);
    let sorted = if 2 * asked.len() >= points.len() { Sorted::new(points, index) } else { None };
    let distances_sq: Vec<f32> = match sorted {
        Some(sorted) => sorted.nearest_others_sq(&asked),
        None => asked.par_iter().filter_map(|&i| nearest_other_sq(points, index, i)).collect(),
    };
    measured(distances_sq, points.len() <= queries)
}

/// Measures a cloud as `resolution_at` does, without an index; for few queries this is cheaper than building one.
#[must_use]
pub fn resolution_sampled(points: &[Point], queries: usize) -> Option<Resolution> {
    Spacings::sampled(points, queries).resolution()
}

/// How far some points of a cloud are from their nearest other points.
pub struct Spacings<'a> {
    points: &'a [Point],
    /// Positions of the points that were measured.
    asked: Vec<u32>,
    /// The nearest other point of each; infinitely far if there is none.
    nearest: Vec<Neighbor>,
}

impl<'a> Spacings<'a> {
    /// Measures at `queries` points drawn uniformly (at all of them if there are no more).
    #[must_use]
    pub fn sampled(points: &'a [Point], queries: usize) -> Self {
        let asked = drawn(points.len(), queries);
        let nearest = nearest_others(points, &asked);
        Spacings { points, asked, nearest }
    }

    /// Returns the resolution; `None` for fewer than two distinct points.
    #[must_use]
    pub fn resolution(&self) -> Option<Resolution> {
        let distances_sq = self.nearest.iter().map(|other| other.distance_sq).collect();
        measured(distances_sq, self.points.len() <= self.asked.len())
    }

    /// Returns the scanner, if the spacings give it away.
    #[must_use]
    pub fn scanner(&self) -> Option<Scanner> {
        let place = |i: u32| wide(self.points[i as usize]);
        let measured = self.asked.iter().zip(&self.nearest);
        let elsewhere = measured.filter(|(_, other)| other.distance_sq > 0.0 && other.distance_sq.is_finite());
        let spaced = elsewhere.map(|(&i, other)| Spaced { point: place(i), offset: place(other.index) - place(i) });
        Scanner::of(&spaced.collect::<Vec<_>>())
    }
}

fn drawn(n: usize, queries: usize) -> Vec<u32> {
    if n <= queries {
        return (0..n as u32).collect();
    }
    let mut stream = Stream::new(0, n as u64);
    (0..queries).map(|_| stream.below(n as u32)).collect()
}

/// Evaluates squared distances; an infinite one was not found.
fn measured(mut distances_sq: Vec<f32>, is_exact: bool) -> Option<Resolution> {
    distances_sq.retain(|distance_sq| distance_sq.is_finite());
    if distances_sq.is_empty() {
        return None;
    }
    let median = median_sq(&distances_sq).sqrt();
    let alone = if median > 0.0 { ALONE * median } else { f64::INFINITY };
    let distances = || distances_sq.iter().map(|&distance_sq| f64::from(distance_sq).sqrt());
    let counted = || distances().filter(|d| *d <= alone);
    let n = counted().count() as f64;
    let mean = counted().sum::<f64>() / n;
    let variance = || counted().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
    let standard_error = if is_exact { 0.0 } else { (variance() / n).sqrt() };
    let lonely = distances().filter(|d| *d > LONELY * median).count() as f64 / distances_sq.len() as f64;
    (mean > 0.0).then_some(Resolution { mean, median, lonely, standard_error })
}

/// Returns the median: non-negative numbers sort like their bits, and integers are selected several times as fast.
fn median_sq(distances_sq: &[f32]) -> f64 {
    let mut bits: Vec<u32> = distances_sq.iter().map(|distance_sq| distance_sq.to_bits()).collect();
    let half = bits.len() / 2;
    f64::from(f32::from_bits(*bits.select_nth_unstable(half).1))
}

fn nearest_other_sq(points: &[Point], index: &NeighborIndex, i: u32) -> Option<f32> {
    let two = index.nearest_n(&points[i as usize], 2);
    two.get(1).map(|second| second.distance_sq)
}

/// Number of points at which the distance between neighbours is estimated, and the width of a cell in such distances.
const GUESSED_AT: usize = 64;
const SIDE: f64 = 4.5;
/// Fraction of the square of a cell's side below which, whatever the rounding, no nearer point can be outside a block.
const WITHIN: f64 = 0.998;

/// A cloud sorted into cells that are wider than the distance between its points.
struct Sorted {
    ordered: OrderedPoints,
    side: f64,
}

impl Sorted {
    /// Returns `None` if points are crowded, or have no others.
    fn new(points: &[Point], index: &NeighborIndex) -> Option<Self> {
        let some = (0..points.len() as u32).step_by(points.len().div_ceil(GUESSED_AT).max(1));
        let mut distances_sq: Vec<f32> = some.filter_map(|i| nearest_other_sq(points, index, i)).collect();
        distances_sq.sort_by(f32::total_cmp);
        let side = SIDE * f64::from(*distances_sq.get(distances_sq.len() / 2)?).sqrt();
        Some(Sorted { ordered: OrderedPoints::unless_crowded(points, side)?, side })
    }

    /// Returns the squared distances from the points `asked` (positions) to their nearest other points, in their order.
    fn nearest_others_sq(&self, asked: &[u32]) -> Vec<f32> {
        // A point farther away than a cell is wide may not be in the block.
        let within = (WITHIN * self.side * self.side) as f32;
        let nearest_sq = self.ordered.each_block(|(): &mut (), members, block, nearest_sq| {
            nearest_others_in(block, nearest_sq);
            for (found, place) in nearest_sq.iter_mut().zip(members).filter(|(found, _)| **found > within) {
                *found = self.ordered.nearest_other_sq(&self.ordered.point(place), self.side);
            }
        });
        let of_point = self.ordered.in_order_of_points(&nearest_sq);
        asked.iter().map(|&i| of_point[i as usize]).collect()
    }
}

/// Computes, for each point of a cell, the squared distance to the nearest other point of its block.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn nearest_others_in(block: &mut Block, found: &mut [f32]) {
    block.each_without_itself(found, |[x, y, z], [xs, ys, zs]| {
        let mut nearest = [f32::INFINITY; LANES];
        for ((xs, ys), zs) in xs.iter().zip(ys).zip(zs) {
            for lane in 0..LANES {
                let (dx, dy, dz) = (xs[lane] - x, ys[lane] - y, zs[lane] - z);
                nearest[lane] = lesser(dx * dx + dy * dy + dz * dz, nearest[lane]);
            }
        }
        let mut width = LANES / 2;
        while width > 0 {
            (0..width).for_each(|lane| nearest[lane] = lesser(nearest[lane], nearest[lane + width]));
            width /= 2;
        }
        nearest[0]
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize, step: f32) -> Vec<Point> {
        (0..n * n).map(|i| [(i % n) as f32 * step, (i / n) as f32 * step, 0.0]).collect()
    }

    #[test]
    fn a_unit_grid_has_resolution_one() {
        let points = grid(30, 1.0);
        assert_eq!(
            resolution(&points, &NeighborIndex::new(&points)).unwrap(),
            Resolution { mean: 1.0, median: 1.0, lonely: 0.0, standard_error: 0.0 }
        );
    }

    #[test]
    fn it_scales_with_the_cloud() {
        let points = grid(20, 0.25);
        assert_eq!(resolution(&points, &NeighborIndex::new(&points)).unwrap().mean, 0.25);
    }

    #[test]
    fn a_point_that_hangs_alone_does_not_change_it() {
        let mut points = grid(20, 0.25);
        points.push([0.0, 0.0, 300.0]);
        let exact = resolution(&points, &NeighborIndex::new(&points)).unwrap();
        assert_eq!((exact.mean, exact.lonely), (0.25, 1.0 / 401.0));
        assert_eq!(resolution_sampled(&points, points.len()), Some(exact));
    }

    #[test]
    fn large_clouds_are_sampled() {
        let points = grid(500, 2.0);
        let measured = resolution(&points, &NeighborIndex::new(&points)).unwrap();
        assert!((measured.mean - 2.0).abs() < 1e-9 && measured.standard_error < 1e-9);
    }

    #[test]
    fn with_or_without_an_index_it_is_the_same() {
        let points: Vec<Point> = (0..5000).map(|i| [(i % 71) as f32 * 0.3, (i / 71) as f32, (i % 5) as f32]).collect();
        for queries in [300, 9000] {
            let by_index = resolution_at(&points, &NeighborIndex::new(&points), queries).unwrap();
            let sampled = resolution_sampled(&points, queries).unwrap();
            assert!((by_index.mean - sampled.mean).abs() < 1e-6 * by_index.mean);
        }
    }

    #[test]
    fn a_cloud_of_strays_is_measured_as_the_tree_measures_it() {
        let mut stream = Stream::new(5, 1);
        let mut points: Vec<Point> =
            (0..3000).map(|_| [stream.between(0.0, 30.0) as f32, stream.between(0.0, 30.0) as f32, 0.0]).collect();
        points.extend((0..60).map(|i| [40.0 + 9.0 * i as f32, 80.0, -3.0 * i as f32]));
        let index = NeighborIndex::new(&points);
        let by_tree: Vec<f32> = (0..points.len() as u32).filter_map(|i| nearest_other_sq(&points, &index, i)).collect();
        assert_eq!(resolution(&points, &index), measured(by_tree, true));
    }

    #[test]
    fn less_than_two_distinct_points_have_none() {
        for points in [vec![], vec![[1.0f32; 3]], vec![[1.0; 3]; 4]] {
            assert!(resolution_sampled(&points, 10).is_none());
            assert!(resolution(&points, &NeighborIndex::new(&points)).is_none());
        }
    }
}
