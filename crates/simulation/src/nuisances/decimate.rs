//! Uniform thinning with a voxel grid.

use super::only;
use congruent_geometry::{Coordinates, RawScan, most_central};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Tolerated relative difference between the count reached and the count wanted.
const TOLERANCE: f64 = 0.005;
/// Maximum number of halvings of the interval of leaf sizes; 40 reach the precision of `f32` from any start.
const MOST_STEPS: usize = 40;

/// Keeps about the given fraction of the points, evenly in space: in each occupied cell of a cubic grid the point
/// nearest to the cell's centre (ties go to the first).
///
/// The cell size is found by bisection until the count is within 0.5 % of the wanted one. Small or gridded clouds may
/// not allow that; they get the closest count met on the way. Points that are not finite are removed unless the
/// fraction is one, and at least one finite point is kept.
#[must_use]
pub fn decimate_uniform(scan: &RawScan, share: f64) -> RawScan {
    if share >= 1.0 {
        return scan.clone();
    }
    let wanted = share.max(0.0) * scan.points.len() as f64;
    let mut keep = vec![false; scan.points.len()];
    for i in Grid::new(&scan.points).closest_to(wanted) {
        keep[i as usize] = true;
    }
    only(scan, &keep)
}

/// The finite points, relative to their lowest corner.
struct Grid {
    points: Vec<(u32, Vector3<f64>)>,
    extent: f64,
}

impl Grid {
    fn new(points: &Coordinates) -> Self {
        let finite = (0u32..).zip(points.iter()).filter(|(_, p)| p.iter().all(|v| v.is_finite()));
        let mut points: Vec<(u32, Vector3<f64>)> = finite.map(|(i, p)| (i, p.into())).collect();
        let low = points.iter().fold(Vector3::repeat(f64::INFINITY), |low, (_, p)| low.inf(p));
        points.iter_mut().for_each(|(_, p)| *p -= low);
        let extent = points.iter().map(|(_, p)| p.amax()).fold(0.0, f64::max);
        Grid { points, extent }
    }

    /// Returns one point of each cell, with a cell size for which there are about `wanted`.
    fn closest_to(&self, wanted: f64) -> Vec<u32> {
        // A leaf beyond the extent leaves one cell; with a millionth of it, nearly every point has its own.
        let (mut low, mut high) = ((self.extent * 1e-6).ln(), (self.extent * 2.0).ln());
        let mut best = self.representatives(self.extent * 2.0);
        for _ in 0..MOST_STEPS {
            let error = |kept: &[u32]| (kept.len() as f64 - wanted).abs();
            if error(&best) <= TOLERANCE * wanted || self.extent == 0.0 {
                break;
            }
            let middle = f64::midpoint(low, high);
            let kept = self.representatives(middle.exp());
            if kept.len() as f64 > wanted {
                low = middle
            } else {
                high = middle
            }
            if error(&kept) < error(&best) {
                best = kept;
            }
        }
        best
    }

    /// Returns the point nearest to the centre of each cell of side `leaf`.
    fn representatives(&self, leaf: f64) -> Vec<u32> {
        let kept = most_central(self.points.par_iter().map(|(_, p)| (*p).into()), leaf);
        kept.into_iter().map(|i| self.points[i as usize].0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nuisances::tests::{cloud, survivors};

    #[test]
    fn the_wanted_share_is_met_within_half_a_percent() {
        let all = cloud(20_000);
        for share in [0.2, 0.4, 0.6, 0.7, 0.8, 0.9] {
            let kept = survivors(&all, &decimate_uniform(&all, share));
            assert!((kept.len() as f64 / 20_000.0 / share - 1.0).abs() <= TOLERANCE, "{share}: {}", kept.len());
            assert!(kept.is_sorted());
        }
        assert_eq!(decimate_uniform(&all, 1.0), all);
        assert_eq!(decimate_uniform(&all, 0.0).points.len(), 1);
    }

    #[test]
    fn dense_regions_lose_more_than_sparse_ones() {
        let mut scan = RawScan { points: cloud(4000).points, ..RawScan::default() };
        let squeezed = scan.points.iter().map(|p| [p[0] * 0.1 + 20.0, p[1], p[2]]);
        scan.points = scan.points.iter().chain(squeezed).collect();
        let kept = decimate_uniform(&scan, 0.3).points;
        let n_sparse = kept.iter().filter(|p| p[0] < 15.0).count();
        assert!(n_sparse * 2 > (kept.len() - n_sparse) * 3, "{n_sparse} of {}", kept.len());
    }

    #[test]
    fn the_point_nearest_to_the_cells_centre_stays() {
        let points = [[0.0, 0.0, 0.0], [0.9, 0.0, 0.0], [0.4, 0.0, 0.0], [1.6, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let mut kept = Grid::new(&points.to_vec().into()).representatives(1.0);
        kept.sort_unstable();
        assert_eq!(kept, [2, 3, 4]);
    }

    #[test]
    fn odd_clouds_are_thinned_as_far_as_they_can() {
        let of = |points: Vec<[f64; 3]>| RawScan { points: points.into(), ..RawScan::default() };
        assert!(decimate_uniform(&RawScan::default(), 0.5).points.is_empty());
        assert_eq!(decimate_uniform(&of(vec![[3.0; 3]; 9]), 0.5).points.len(), 1);
        assert_eq!(decimate_uniform(&of(vec![[f64::NAN; 3], [1.0; 3], [2.0; 3]]), 0.5).points.len(), 1);
        assert!(decimate_uniform(&of(vec![[f64::INFINITY; 3]]), 0.5).points.is_empty());
    }
}
