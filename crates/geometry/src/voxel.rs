//! Voxel grids: one point for each occupied cell.

use crate::{Point, narrow};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Points, with normals where the input had them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Centroids.
    pub points: Vec<Point>,
    /// Mean directions, unit length; zero where the cell's normals cancel.
    pub normals: Option<Vec<Point>>,
}

/// Steps into which a cell's side is cut where means are formed: sums of whole steps do not depend on their order.
const STEPS: f64 = (1u64 << 36) as f64;

/// The centroid of the points in each cubic cell of side `leaf`; cells are `floor(x / leaf)` on each axis.
///
/// Sorted by cell. Neither the result nor a bit of it depends on the order of the points. A leaf below 2⁻⁵⁰ of the largest
/// coordinate counts as that.
#[must_use]
pub fn voxel_centroids(points: &[Point], normals: Option<&[Point]>, leaf: f64) -> Sample {
    let leaf = usable(points, leaf);
    match Packing::of(points, leaf) {
        Some(packing) => centroids(points, normals, leaf, |p| packing.key(&cell(p, leaf))),
        None => centroids(points, normals, leaf, |p| cell(p, leaf)),
    }
}

/// How many centroids there would be.
#[must_use]
pub fn voxel_count(points: &[Point], leaf: f64) -> usize {
    let leaf = usable(points, leaf);
    match Packing::of(points, leaf) {
        Some(packing) => count(points, |p| packing.key(&cell(p, leaf))),
        None => count(points, |p| cell(p, leaf)),
    }
}

type Cell = [i64; 3];

/// Finer cells could not be numbered.
fn usable(points: &[Point], leaf: f64) -> f64 {
    let largest = points.iter().flatten().fold(0.0f32, |largest, v| largest.max(v.abs()));
    leaf.max(f64::from(largest) * 2f64.powi(-50))
}

fn cell(p: &Point, leaf: f64) -> Cell {
    p.map(|v| (f64::from(v) / leaf).floor() as i64)
}

/// Cells as single numbers in the same order, where all of a cloud's fit.
struct Packing {
    low: Cell,
    bits: [u32; 3],
}

impl Packing {
    fn of(points: &[Point], leaf: f64) -> Option<Packing> {
        let first = cell(points.first()?, leaf);
        let (low, high) = points.iter().map(|p| cell(p, leaf)).fold((first, first), |(low, high), c| {
            (std::array::from_fn(|k| low[k].min(c[k])), std::array::from_fn(|k| high[k].max(c[k])))
        });
        let bits = std::array::from_fn(|k| u64::BITS - high[k].abs_diff(low[k]).leading_zeros());
        (bits.iter().sum::<u32>() <= u64::BITS).then_some(Packing { low, bits })
    }

    fn key(&self, cell: &Cell) -> u64 {
        // A shift by 64 comes only with a cell that is zero.
        (0..3).fold(0, |key: u64, axis| {
            key.checked_shl(self.bits[axis]).unwrap_or(0) | cell[axis].abs_diff(self.low[axis])
        })
    }
}

fn count<K: Ord + Send + Sync>(points: &[Point], key: impl Fn(&Point) -> K + Send + Sync) -> usize {
    let mut keys: Vec<K> = points.par_iter().map(key).collect();
    keys.par_sort_unstable();
    keys.chunk_by(|a, b| a == b).count()
}

fn centroids<K: Ord + Copy + Send + Sync>(
    points: &[Point],
    normals: Option<&[Point]>,
    leaf: f64,
    key: impl Fn(&Point) -> K + Send + Sync,
) -> Sample {
    let mut order: Vec<(K, u32)> = points.par_iter().map(key).zip(0u32..points.len() as u32).collect();
    order.par_sort_unstable_by_key(|member| member.0);
    let mut sample = Sample { points: Vec::new(), normals: normals.map(|_| Vec::new()) };
    for members in order.chunk_by(|a, b| a.0 == b.0) {
        let own = || members.iter().map(|member| member.1 as usize);
        let corner = cell(&points[members[0].1 as usize], leaf).map(|c| c as f64);
        let sum = own().fold([0i64; 3], |sum, i| {
            std::array::from_fn(|k| sum[k] + ((f64::from(points[i][k]) / leaf - corner[k]) * STEPS) as i64)
        });
        let mean = |k: usize| (corner[k] + sum[k] as f64 / STEPS / members.len() as f64) * leaf;
        sample.points.push(narrow(&Vector3::from_fn(|k, _| mean(k))));
        if let (Some(out), Some(normals)) = (sample.normals.as_mut(), normals) {
            let sum = own()
                .fold([0i64; 3], |sum, i| std::array::from_fn(|k| sum[k] + (f64::from(normals[i][k]) * STEPS) as i64));
            let sum = Vector3::from(sum.map(|steps| steps as f64 / STEPS));
            out.push(narrow(&sum.try_normalize(1e-6).unwrap_or_default()));
        }
    }
    sample
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    fn cloud() -> Vec<Point> {
        let mut stream = Stream::new(5, 0);
        (0..2000)
            .map(|_| [stream.between(-3.0, 3.0) as f32, stream.between(-3.0, 3.0) as f32, stream.unit() as f32])
            .collect()
    }

    #[test]
    fn one_centroid_a_cell_inside_its_cell() {
        let (points, leaf) = (cloud(), 0.5);
        let cell = |p: &Point| p.map(|v| (f64::from(v) / leaf).floor() as i64);
        let mut cells: Vec<_> = points.iter().map(cell).collect();
        cells.sort();
        cells.dedup();
        let sample = voxel_centroids(&points, None, leaf);
        assert_eq!(sample.points.iter().map(cell).collect::<Vec<_>>(), cells);
    }

    #[test]
    fn the_order_of_the_points_does_not_matter() {
        let points = cloud();
        let mut reversed = points.clone();
        reversed.reverse();
        assert_eq!(voxel_centroids(&points, None, 0.7), voxel_centroids(&reversed, None, 0.7));
    }

    #[test]
    fn a_huge_or_tiny_leaf_is_fine() {
        let points = cloud();
        assert_eq!(voxel_centroids(&points, None, 1e-9).points.len(), points.len());
        assert!(voxel_centroids(&points, None, 1e9).points.len() <= 8);
        assert!(voxel_centroids(&[], None, 1.0).points.is_empty());
        assert_eq!(voxel_count(&[], 1.0), 0);
    }

    #[test]
    fn packed_or_not_the_cells_are_the_same() {
        let points = cloud();
        for leaf in [1e-30, 1e-9, 1e-4, 0.3, 0.7, 1e9] {
            let sample = voxel_centroids(&points, None, leaf);
            assert_eq!(voxel_count(&points, leaf), sample.points.len());
            let leaf = usable(&points, leaf);
            assert_eq!(sample, centroids(&points, None, leaf, |p| cell(p, leaf)), "{leaf}");
        }
    }

    #[test]
    fn centroids_are_means() {
        let points = cloud();
        let mean = voxel_centroids(&points, None, 1e9).points;
        let octant = |p: &&Point| p.iter().all(|v| *v >= 0.0);
        let inside: Vec<&Point> = points.iter().filter(octant).collect();
        for k in 0..3 {
            let expected = inside.iter().map(|p| f64::from(p[k])).sum::<f64>() / inside.len() as f64;
            // A cell of 10⁹ is cut into steps of 0.015.
            assert!((f64::from(mean.last().unwrap()[k]) - expected).abs() < 0.02);
        }
    }

    #[test]
    fn normals_are_averaged() {
        let sample = voxel_centroids(&[[0.1; 3], [0.2; 3]], Some(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 1.0);
        let normal = sample.normals.unwrap()[0];
        assert!((normal[0] - 0.5f32.sqrt()).abs() < 1e-6 && normal[2] == 0.0);
    }
}
