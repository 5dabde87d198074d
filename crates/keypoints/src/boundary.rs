//! The boundary of a surface: points with a wide gap in the ring of their neighbours (as in PCL's
//! `BoundaryEstimation`).

use congruent_geometry::{Surface, wide};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Gap between neighbouring directions above which a point is on the boundary, radians; PCL's default.
const MAX_GAP: f64 = FRAC_PI_2;
/// Minimum number of neighbours, the point itself included, for a decision; PCL's bound.
const MIN_NEIGHBORS: usize = 3;

/// Returns, for each point, whether a boundary point lies within `radius`, itself included.
pub(crate) fn near_boundary(surface: &Surface, radius: f64) -> Vec<bool> {
    let on_boundary: Vec<bool> =
        (0..surface.len()).into_par_iter().map(|i| is_on_boundary(surface, i, radius)).collect();
    let near = |point| {
        let mut near = false;
        surface.index().within(point, radius, |n| near |= on_boundary[n.index as usize]);
        near
    };
    surface.points().par_iter().map(near).collect()
}

/// Returns whether a point is on the boundary; `false` if it has no normal or too few neighbours.
fn is_on_boundary(surface: &Surface, i: usize, radius: f64) -> bool {
    let Some(normal) = wide(surface.normals()[i]).try_normalize(0.0) else { return false };
    let u = perpendicular(&normal);
    let v = normal.cross(&u);
    let centre = wide(surface.points()[i]);
    let (mut angles, mut count) = (Vec::new(), 0);
    surface.index().within(&surface.points()[i], radius, |n| {
        let offset = wide(surface.points()[n.index as usize]) - centre;
        count += 1;
        if offset != Vector3::zeros() {
            angles.push(offset.dot(&v).atan2(offset.dot(&u)));
        }
    });
    count >= MIN_NEIGHBORS && widest_gap(&mut angles).is_some_and(|gap| gap > MAX_GAP)
}

/// Returns the widest gap between directions around the circle, radians; `None` without directions.
fn widest_gap(angles: &mut [f64]) -> Option<f64> {
    angles.sort_by(f64::total_cmp);
    let around = TAU - (angles.last()? - angles.first()?);
    Some(angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max))
}

/// Returns a unit vector perpendicular to another: its cross product with the axis along which it is shortest.
fn perpendicular(normal: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    normal.cross(&axis).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_simulation::testing::plane;

    #[test]
    fn the_rim_of_a_square_is_its_boundary() {
        let plane = plane(20);
        for i in 0..400 {
            let rim = [i % 20, i / 20].iter().any(|&c| c == 0 || c == 19);
            assert_eq!(is_on_boundary(&plane, i, 2.5), rim, "{i}");
        }
        let near = near_boundary(&plane, 2.5);
        assert!(near[2 * 20 + 10] && !near[3 * 20 + 10]);
    }

    #[test]
    fn gaps_are_measured_around_the_circle() {
        assert_eq!(widest_gap(&mut []), None);
        assert_eq!(widest_gap(&mut [1.0]), Some(TAU));
        assert!((widest_gap(&mut [3.0, -3.0, 0.0]).unwrap() - 3.0).abs() < 1e-12);
    }
}
