//! Holes such as those left by dark or wet patches.

use super::only;
use congruent_geometry::random::Stream;
use congruent_geometry::{NeighborIndex, Point, RawScan, narrow};
use nalgebra::Vector3;

/// Fraction of the cloud that a hole removes; the second number is the minimum number of points.
const SHARE: f64 = 0.01;
const FEWEST: usize = 20;
/// Number of random centres tried for one hole before it may overlap another.
const MOST_TRIES: usize = 100;

/// Cuts `count` holes, each around a random point whose nearest neighbours are removed: 1 % of the cloud and at least
/// 20 points, including the centre.
///
/// Centres are at least the larger of the two holes' radii apart if 100 random tries find such a place; otherwise holes
/// overlap and remove less. Points that are not finite are kept; once no finite point is left, the remaining holes are
/// not cut.
#[must_use]
pub fn cut_holes(scan: &RawScan, count: usize, seed: u64) -> RawScan {
    let places: Vec<usize> =
        (0..scan.points.len()).filter(|&i| scan.points.at(i).iter().all(|v| v.is_finite())).collect();
    let origin = places.first().map_or_else(Vector3::zeros, |&i| scan.points.at(i).into());
    let points: Vec<Point> = places.iter().map(|&i| narrow(&(Vector3::from(scan.points.at(i)) - origin))).collect();
    let mut cutter = Cutter {
        index: NeighborIndex::new(&points),
        n_removed: FEWEST.max((SHARE * points.len() as f64).round() as usize),
        left: vec![true; points.len()],
        holes: Vec::new(),
        points,
    };
    for hole in 0..count as u64 {
        cutter.cut(&mut Stream::new(seed, hole));
    }
    let mut keep = vec![true; scan.points.len()];
    places.iter().zip(&cutter.left).for_each(|(&i, &left)| keep[i] = left);
    only(scan, &keep)
}

struct Hole {
    centre: Point,
    radius_sq: f32,
    members: Vec<u32>,
}

struct Cutter {
    points: Vec<Point>,
    index: NeighborIndex,
    n_removed: usize,
    left: Vec<bool>,
    holes: Vec<Hole>,
}

impl Cutter {
    /// Cuts one hole, if there is anything left to cut.
    fn cut(&mut self, stream: &mut Stream) {
        let candidates: Vec<u32> = (0u32..).zip(&self.left).filter(|(_, left)| **left).map(|(i, _)| i).collect();
        if candidates.is_empty() {
            return;
        }
        let mut hole = self.hole_at(candidates[stream.below(candidates.len() as u32) as usize]);
        for _ in 1..MOST_TRIES {
            if self.is_apart(&hole) {
                break;
            }
            hole = self.hole_at(candidates[stream.below(candidates.len() as u32) as usize]);
        }
        hole.members.iter().for_each(|&i| self.left[i as usize] = false);
        self.holes.push(hole);
    }

    /// Returns the hole around a centre; its neighbours are those of the uncut cloud, so that all holes have the same
    /// shape.
    fn hole_at(&self, centre: u32) -> Hole {
        let centre = self.points[centre as usize];
        let neighbors = self.index.nearest_n(&centre, self.n_removed);
        let radius_sq = neighbors.last().map_or(0.0, |farthest| farthest.distance_sq);
        Hole { centre, radius_sq, members: neighbors.iter().map(|n| n.index).collect() }
    }

    fn is_apart(&self, hole: &Hole) -> bool {
        let distance_sq = |other: &Hole| -> f32 { (0..3).map(|k| (other.centre[k] - hole.centre[k]).powi(2)).sum() };
        self.holes.iter().all(|other| distance_sq(other) >= hole.radius_sq.max(other.radius_sq))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nuisances::tests::{cloud, survivors};

    #[test]
    fn one_hole_removes_a_disc_of_one_percent() {
        let all = cloud(5000);
        let kept = survivors(&all, &cut_holes(&all, 1, 3));
        assert_eq!(kept.len(), 4950);
        let is_kept = |i: &u32| kept.binary_search(i).is_ok();
        let at = |i: u32| Vector3::from(all.points.at(i as usize));
        let gone: Vec<u32> = (0..5000).filter(|i| !is_kept(i)).collect();
        // Some removed point is the centre: all other removed points are nearer to it than any point kept.
        let is_centre = |c: u32| {
            let radius = gone.iter().map(|&i| (at(i) - at(c)).norm()).fold(0.0, f64::max);
            kept.iter().all(|&i| (at(i) - at(c)).norm() >= radius)
        };
        assert!(gone.iter().any(|&c| is_centre(c)));
    }

    #[test]
    fn many_holes_remove_at_most_their_sum_and_mostly_do_not_overlap() {
        let all = cloud(5000);
        for count in [6, 10, 14, 18, 22, 26] {
            let n_gone = 5000 - survivors(&all, &cut_holes(&all, count, 1)).len();
            // Centres are a radius apart: at most 39 % of a disc can lie in one neighbour, in practice far less.
            assert!(n_gone <= 50 * count && n_gone >= 35 * count, "{count}: {n_gone}");
        }
        assert_eq!(cut_holes(&all, 6, 1), cut_holes(&all, 6, 1));
        assert_ne!(cut_holes(&all, 6, 1), cut_holes(&all, 6, 2));
        assert_eq!(cut_holes(&all, 0, 1), all);
    }

    #[test]
    fn a_small_cloud_is_eaten_up_without_complaint() {
        let mut small = cloud(30);
        small.points.edited()[7] = [f64::NAN; 3];
        let left = cut_holes(&small, 5, 0);
        assert_eq!(left.points.len(), 1);
        assert!(left.points.at(0)[0].is_nan());
        assert_eq!(cut_holes(&RawScan::default(), 3, 0), RawScan::default());
    }
}
