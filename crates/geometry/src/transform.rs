//! Rigid motions, and the measures of them that several stages need.

use crate::{Point, wide};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A rigid motion in `f64`. A value named `target_from_source` maps source points into the target's frame.
pub type RigidTransform = Isometry3<f64>;

/// Returns the 4×4 matrix, row by row; the last row is `0 0 0 1`.
#[must_use]
pub fn to_rows(transform: &RigidTransform) -> [[f64; 4]; 4] {
    let matrix = transform.to_homogeneous();
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// Returns the rigid motion nearest to a 4×4 matrix given row by row.
///
/// `None` if its upper left 3×3 is farther than `tolerance` (Frobenius norm) from a rotation, or if anything is not
/// finite.
#[must_use]
pub fn from_rows(rows: &[[f64; 4]; 4], tolerance: f64) -> Option<RigidTransform> {
    if rows.iter().flatten().any(|v| !v.is_finite()) {
        return None;
    }
    let linear = Matrix3::from_fn(|row, column| rows[row][column]);
    let svd = linear.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum())) * v_t;
    if (rotation - linear).norm() > tolerance {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(RigidTransform::from_parts(Translation3::new(rows[0][3], rows[1][3], rows[2][3]), rotation))
}

/// Returns the angle between the rotations of two motions, radians. Accurate near zero, where the usual arc cosine of
/// the trace loses half its digits.
#[must_use]
pub fn angle_between(a: &RigidTransform, b: &RigidTransform) -> f64 {
    let difference = a.rotation.to_rotation_matrix().matrix() - b.rotation.to_rotation_matrix().matrix();
    2.0 * (difference.norm() / 8f64.sqrt()).min(1.0).asin()
}

/// Returns the mean distance between where two motions put the same points; zero without points.
#[must_use]
pub fn mean_displacement(points: &[Point], a: &RigidTransform, b: &RigidTransform) -> f64 {
    let total: f64 = points
        .iter()
        .map(|&p| {
            let p = nalgebra::Point3::from(wide(p));
            (a * p - b * p).norm()
        })
        .sum();
    if points.is_empty() { 0.0 } else { total / points.len() as f64 }
}

/// Converts a motion between centred clouds to the original coordinates: `t_out = t + o_target − R o_source`.
#[must_use]
pub fn uncentred(
    centred: &RigidTransform,
    source_origin: &Vector3<f64>,
    target_origin: &Vector3<f64>,
) -> RigidTransform {
    let translation = centred.translation.vector + target_origin - centred.rotation * source_origin;
    RigidTransform::from_parts(Translation3::from(translation), centred.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn example() -> RigidTransform {
        RigidTransform::new(Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.3, -0.7, 1.1))
    }

    #[test]
    fn rows_survive_the_round_trip() {
        let back = from_rows(&to_rows(&example()), 1e-9).unwrap();
        assert!((back.to_homogeneous() - example().to_homogeneous()).norm() < 1e-12);
    }

    #[test]
    fn a_matrix_that_is_no_rotation_is_refused() {
        let mut rows = to_rows(&example());
        rows[0][0] += 0.1;
        assert!(from_rows(&rows, 1e-3).is_none());
        rows[0][0] = f64::NAN;
        assert!(from_rows(&rows, 1e-3).is_none());
        let mirror = [[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        assert!(from_rows(&mirror, 1e-3).is_none());
    }

    #[test]
    fn tiny_and_large_angles_are_exact() {
        for angle in [1e-9, 1e-3, 1.0, 3.0] {
            let turned = RigidTransform::rotation(Vector3::new(0.0, 0.0, angle)) * example();
            assert!((angle_between(&turned, &example()) - angle).abs() < 1e-12 + 1e-8 * angle, "{angle}");
        }
    }

    #[test]
    fn the_origins_come_back_in() {
        let (source_origin, target_origin) = (Vector3::new(1e6, 2e6, 30.0), Vector3::new(-4e5, 7.0, 1e6));
        let centred = example();
        let full = uncentred(&centred, &source_origin, &target_origin);
        let p = Point3::new(1e6 + 1.0, 2e6 - 2.0, 33.0);
        let expected = centred * (p - source_origin) + target_origin;
        assert!((full * p - expected).norm() < 1e-8);
    }
}
