//! How much of a surface faces the same few directions, as walls, boxes and machines do.

use crate::{Point, wide};
use nalgebra::Vector3;

/// Cosine of the angle, 10 degrees, within which two normals face the same direction, either way round.
const ALIKE: f64 = 0.984_8;
/// Number of directions, each of which may be that of several parallel planes.
const DIRECTIONS: usize = 3;
/// Number of normals whose directions are tried.
const TRIED: usize = 200;
/// Flatness from which a surface is mostly planes: above that of figurines, and that of most fused scans of real rooms.
pub const MOSTLY_FLAT: f64 = 0.6;

/// Returns the fraction of the unit normals that lie within 10 degrees of three directions or their opposites, which are
/// chosen one after the other to hold as many as possible; zero for no normals.
///
/// Figurines have at most 0.32, fused scans of real rooms up to 0.7, noisy box rooms and brackets 0.8 to 1. Zero normals
/// face no direction.
#[must_use]
pub fn flatness(normals: &[Point]) -> f64 {
    let proper = normals.iter().filter(|normal| **normal != [0.0; 3]);
    let mut left: Vec<Vector3<f64>> = proper.map(|normal| wide(*normal)).collect();
    let n_proper = left.len();
    for _ in 0..DIRECTIONS {
        let held = |direction: &Vector3<f64>| left.iter().filter(|n| n.dot(direction).abs() >= ALIKE).count();
        let tried = left.iter().step_by(left.len().div_ceil(TRIED).max(1));
        // The last of equals.
        let Some(best) = tried.max_by_key(|direction| held(direction)).copied() else { break };
        left.retain(|normal| normal.dot(&best).abs() < ALIKE);
    }
    (n_proper - left.len()) as f64 / normals.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn a_box_is_flat_and_a_ball_is_not() {
        let mut stream = Stream::new(1, 0);
        let mut around = |axis: usize, spread: f64| -> Point {
            let tilt = |k: usize, stream: &mut Stream| if k == axis { 1.0 } else { spread * stream.normal() };
            let v = Vector3::from_fn(|k, _| tilt(k, &mut stream));
            crate::narrow(&v.normalize())
        };
        let sides: Vec<Point> = (0..600).map(|i| around(i % 3, 0.05)).collect();
        assert!(flatness(&sides) > 0.95);
        let ball: Vec<Point> = (0..600).map(|i| around(i % 3, 9.0)).collect();
        assert!(flatness(&ball) < 0.5);
    }

    #[test]
    fn no_normals_face_no_direction() {
        assert_eq!(flatness(&[]), 0.0);
        assert_eq!(flatness(&[[0.0; 3]; 4]), 0.0);
        assert_eq!(flatness(&[[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0; 3], [0.0; 3]]), 0.5);
    }
}
