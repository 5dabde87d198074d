//! The roughness of a surface: noise, and detail finer than the spacing of its points.

use crate::{Surface, wide};
use nalgebra::Vector3;

/// Number of points examined, spread evenly over their order.
const LOOKED_AT: usize = 1000;
/// Number of nearest neighbours of each of them.
const BESIDE: usize = 9;

/// Returns the mean distance of a point from the plane through the centroid of its nine nearest neighbours,
/// perpendicular to its normal; data units. `None` if no point has a normal and nine neighbours.
///
/// Two scans of one surface lie about this far apart where they touch; how much farther they lie tells how well they
/// fit.
#[must_use]
pub fn roughness(surface: &Surface) -> Option<f64> {
    let stride = surface.len().div_ceil(LOOKED_AT).max(1);
    let (mut sum, mut n) = (0.0, 0usize);
    for i in (0..surface.len()).step_by(stride) {
        let (point, normal) = (surface.points()[i], wide(surface.normals()[i]));
        let near = surface.index().nearest_n(&point, BESIDE + 1);
        if normal == Vector3::zeros() || near.len() <= BESIDE {
            continue;
        }
        // The first one is the point itself.
        let others = near[1..].iter().map(|other| wide(surface.points()[other.index as usize]) - wide(point));
        sum += (others.sum::<Vector3<f64>>() / BESIDE as f64).dot(&normal).abs();
        n += 1;
    }
    (n > 0).then(|| sum / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::{NeighborIndex, Point};

    /// A sheet of 60 × 60 points with normally distributed heights.
    fn sheet(sigma: f64) -> Surface {
        let mut stream = Stream::new(3, 0);
        let points: Vec<Point> =
            (0..3600u16).map(|i| [f32::from(i % 60), f32::from(i / 60), (sigma * stream.normal()) as f32]).collect();
        let normals = vec![[0.0, 0.0, 1.0]; points.len()];
        let index = NeighborIndex::new(&points);
        Surface::new(points, normals, index, 1.0)
    }

    #[test]
    fn a_plane_is_smooth_and_noise_is_rough() {
        assert_eq!(roughness(&sheet(0.0)), Some(0.0));
        // The mean of |a − b| with b a mean of nine, σ √(2/π · 10/9), would be 0.084; points of similar height are
        // nearer.
        let rough = roughness(&sheet(0.1)).unwrap();
        assert!((0.074..0.084).contains(&rough), "{rough}");
    }

    #[test]
    fn without_normals_or_others_nothing_is_known() {
        let points: Vec<Point> = (0..5u8).map(|i| [f32::from(i), 0.0, 0.0]).collect();
        let index = NeighborIndex::new(&points);
        assert_eq!(roughness(&Surface::new(points, vec![[0.0, 0.0, 1.0]; 5], index, 1.0)), None);
    }
}
