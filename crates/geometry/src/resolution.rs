//! The resolution of a cloud, `pr`: the length all other lengths are measured in.

use crate::random::Stream;
use crate::{NeighborIndex, Point};
use rayon::prelude::*;

/// Clouds up to this size are measured at every point.
const EXACT_UP_TO: usize = 200_000;
/// Larger ones at this many points, drawn evenly.
const SAMPLED_AT: usize = 50_000;

/// Mean distance from a point to its nearest other point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// In data units.
    pub mean: f64,
    /// Of the mean; zero where every point was measured.
    pub standard_error: f64,
}

/// Measures a cloud of at least two distinct points; `None` for fewer.
///
/// Exact duplicates would count as distance zero and drag the mean down, so they must be gone before. Above 200 000
/// points, 50 000 of them are asked (against the whole cloud).
#[must_use]
pub fn resolution(points: &[Point], index: &NeighborIndex) -> Option<Resolution> {
    resolution_at(points, index, if points.len() <= EXACT_UP_TO { points.len() } else { SAMPLED_AT })
}

/// The same, asked at `queries` points drawn evenly (at all of them where there are no more).
#[must_use]
pub fn resolution_at(points: &[Point], index: &NeighborIndex, queries: usize) -> Option<Resolution> {
    let is_exact = points.len() <= queries;
    let asked: Vec<u32> = if is_exact {
        (0..points.len() as u32).collect()
    } else {
        let mut stream = Stream::new(0, points.len() as u64);
        (0..queries).map(|_| stream.below(points.len() as u32)).collect()
    };
    let distances: Vec<f64> = asked.par_iter().filter_map(|&i| nearest_other(points, index, i)).collect();
    let n = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / n;
    let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
    let standard_error = if is_exact { 0.0 } else { (variance / n).sqrt() };
    (mean > 0.0).then_some(Resolution { mean, standard_error })
}

fn nearest_other(points: &[Point], index: &NeighborIndex, i: u32) -> Option<f64> {
    let two = index.nearest_n(&points[i as usize], 2);
    two.get(1).map(|second| f64::from(second.distance_sq).sqrt())
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
            Resolution { mean: 1.0, standard_error: 0.0 }
        );
    }

    #[test]
    fn it_scales_with_the_cloud() {
        let points = grid(20, 0.25);
        assert_eq!(resolution(&points, &NeighborIndex::new(&points)).unwrap().mean, 0.25);
    }

    #[test]
    fn large_clouds_are_sampled() {
        let points = grid(500, 2.0);
        let measured = resolution(&points, &NeighborIndex::new(&points)).unwrap();
        assert!((measured.mean - 2.0).abs() < 1e-9 && measured.standard_error < 1e-9);
    }

    #[test]
    fn less_than_two_distinct_points_have_none() {
        for points in [vec![], vec![[1.0f32; 3]], vec![[1.0; 3]; 4]] {
            assert!(resolution(&points, &NeighborIndex::new(&points)).is_none());
        }
    }
}
