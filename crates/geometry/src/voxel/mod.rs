//! Voxel grids: one point for each occupied cell.

mod cell;
mod central;
mod means;
mod numbered;

use crate::Point;
use crate::bounds::bounds;
use cell::{Leaf, Packing};
pub use central::most_central;
use means::means;
use numbered::{Marks, Numbered, distinct};

/// Points, with normals if the input had them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Centroids.
    pub points: Vec<Point>,
    /// Mean directions, unit length; zero if the cell's normals cancel.
    pub normals: Option<Vec<Point>>,
}

/// Maximum number of bits per point in a bitmap of all cells; beyond it the points' cells are sorted.
const MAX_BITS_PER_POINT: usize = 256;

/// Returns the centroid of the points in each cubic cell of side `leaf`; cells are `floor(x · (1 / leaf))` on each axis.
///
/// Sorted by cell. The result is bit-identical for every order of the points. A leaf below 2⁻⁵⁰ of the largest
/// coordinate is raised to that.
///
/// # Panics
/// With 2³² points or more.
#[must_use]
pub fn voxel_centroids(points: &[Point], normals: Option<&[Point]>, leaf: f64) -> Sample {
    let corners = bounds(points);
    let leaf = Leaf::new(leaf, &corners);
    let numbered = match Packing::of(&corners, leaf) {
        Some(packing) => match packing.few_cells(MAX_BITS_PER_POINT * points.len()) {
            Some(n_cells) => {
                let numbers = packing.numbers(points, leaf);
                Marks::new(&numbers, n_cells).numbered(numbers)
            }
            None => Numbered::by_sorting(points, |p| packing.key(&leaf.cell(p))),
        },
        None => Numbered::by_sorting(points, |p| leaf.cell(p)),
    };
    means(points, normals, leaf, &numbered)
}

/// Returns how many centroids there would be.
#[must_use]
pub fn voxel_count(points: &[Point], leaf: f64) -> usize {
    let corners = bounds(points);
    let leaf = Leaf::new(leaf, &corners);
    match Packing::of(&corners, leaf) {
        Some(packing) => match packing.few_cells(MAX_BITS_PER_POINT * points.len()) {
            Some(n_cells) => Marks::new(&packing.numbers(points, leaf), n_cells).count(),
            None => distinct(points, |p| packing.key(&leaf.cell(p))),
        },
        None => distinct(points, |p| leaf.cell(p)),
    }
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
    fn the_number_of_threads_does_not_matter() {
        let mut stream = Stream::new(7, 0);
        let mut vector = || -> Point { std::array::from_fn(|_| stream.between(-1.0, 1.0) as f32) };
        let points: Vec<Point> = (0..60_000).map(|_| vector()).collect();
        let normals: Vec<Point> = (0..60_000).map(|_| vector()).collect();
        let on_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| voxel_centroids(&points, Some(&normals), 0.1))
        };
        assert_eq!(on_threads(1), on_threads(3));
    }

    #[test]
    fn a_huge_or_tiny_leaf_is_fine() {
        let points = cloud();
        assert_eq!(voxel_centroids(&points, None, 1e-9).points.len(), points.len());
        assert!(voxel_centroids(&points, None, 1e9).points.len() <= 8);
        assert!(voxel_centroids(&[], None, 1.0).points.is_empty());
        assert_eq!(voxel_count(&[], 1.0), 0);
        assert_eq!(voxel_centroids(&[[0.0; 3]; 4], None, 1e-310).points, [[0.0; 3]]);
    }

    #[test]
    fn packed_or_not_the_cells_are_the_same() {
        let points = cloud();
        for side in [1e-30, 1e-9, 1e-4, 0.3, 0.7, 1e9] {
            let sample = voxel_centroids(&points, None, side);
            assert_eq!(voxel_count(&points, side), sample.points.len());
            let corners = bounds(&points);
            let leaf = Leaf::new(side, &corners);
            let by_cell = Numbered::by_sorting(&points, |p| leaf.cell(p));
            assert_eq!(sample, means(&points, None, leaf, &by_cell), "{side}");
            let by_key = Packing::of(&corners, leaf)
                .map(|packing| Numbered::by_sorting(&points, |p| packing.key(&leaf.cell(p))));
            assert!(by_key.is_none_or(|numbered| sample == means(&points, None, leaf, &numbered)), "{side}");
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
