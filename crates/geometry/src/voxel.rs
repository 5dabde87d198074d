//! Voxel grids: one point for each occupied cell.

use crate::{Point, narrow, wide};
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

/// The centroid of the points in each cubic cell of side `leaf`; cells are `floor(x / leaf)` on each axis.
///
/// Sorted by cell. Neither the result nor a bit of it depends on the order of the points.
#[must_use]
pub fn voxel_centroids(points: &[Point], normals: Option<&[Point]>, leaf: f64) -> Sample {
    let cell = |p: &Point| p.map(|v| (f64::from(v) / leaf).floor() as i64);
    let mut order: Vec<([i64; 3], u32)> =
        points.par_iter().zip(0u32..points.len() as u32).map(|(p, i)| (cell(p), i)).collect();
    let by_place = |i: u32, j: u32| {
        let (a, b) = (&points[i as usize], &points[j as usize]);
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
    };
    order.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| by_place(a.1, b.1)));

    let mut sample = Sample { points: Vec::new(), normals: normals.map(|_| Vec::new()) };
    for members in order.chunk_by(|a, b| a.0 == b.0) {
        let sum: Vector3<f64> = members.iter().map(|m| wide(points[m.1 as usize])).sum();
        sample.points.push(narrow(&(sum / members.len() as f64)));
        if let (Some(out), Some(normals)) = (sample.normals.as_mut(), normals) {
            let sum: Vector3<f64> = members.iter().map(|m| wide(normals[m.1 as usize])).sum();
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
    }

    #[test]
    fn normals_are_averaged() {
        let sample = voxel_centroids(&[[0.1; 3], [0.2; 3]], Some(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 1.0);
        let normal = sample.normals.unwrap()[0];
        assert!((normal[0] - 0.5f32.sqrt()).abs() < 1e-6 && normal[2] == 0.0);
    }
}
