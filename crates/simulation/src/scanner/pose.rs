//! Poses of a scanner.

use super::{RangeNoise, VirtualScanner};
use crate::Mesh;
use congruent_geometry::RigidTransform;
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Angle of incidence beyond which returns are lost, as with real scanners.
const USUAL_MAX_INCIDENCE_DEG: f64 = 80.0;
/// Empty border around a framed object, as a fraction of its size.
const BORDER: f64 = 0.02;

/// Returns the pose `world_from_sensor` of a sensor at `position` that looks at `target`, with `up` upwards in the
/// image.
///
/// If `up` is along the view, the axis farthest from the view replaces it; if the target is at the position, the sensor
/// looks along +x.
#[must_use]
pub fn look_at(position: Vector3<f64>, target: Vector3<f64>, up: Vector3<f64>) -> RigidTransform {
    let forward = (target - position).try_normalize(0.0).unwrap_or_else(Vector3::x);
    let spare = Vector3::ith(forward.iamin(), 1.0);
    let right = up.try_normalize(0.0).and_then(|up| forward.cross(&up).try_normalize(1e-9));
    let right = right.unwrap_or_else(|| forward.cross(&spare).normalize());
    let down = forward.cross(&right);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
    RigidTransform::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&rotation))
}

impl VirtualScanner {
    /// Returns a noise-free scanner with a square image that looks at the middle of a mesh from a distance of `factor`
    /// times the radius of its bounding sphere, and frames it closely.
    ///
    /// The angles are in radians: azimuth from +x towards +y, elevation from the horizontal towards +z. From within the
    /// mesh (a factor below about one) the view is 90° wide.
    #[must_use]
    pub fn orbit(mesh: &Mesh, azimuth: f64, elevation: f64, factor: f64, pixels: u32) -> Self {
        let (centre, radius) = mesh.bounding_sphere();
        let outward = Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        let world_from_sensor = look_at(centre + outward * (factor * radius), centre, Vector3::z());
        VirtualScanner {
            world_from_sensor,
            width: pixels,
            height: pixels,
            horizontal_view: framing_view(mesh, &world_from_sensor),
            noise: RangeNoise::default(),
            max_incidence: USUAL_MAX_INCIDENCE_DEG.to_radians(),
        }
    }
}

/// Returns the view angle whose square image just holds the mesh; a right angle if some of it is not in front.
fn framing_view(mesh: &Mesh, world_from_sensor: &RigidTransform) -> f64 {
    let sensor_from_world = world_from_sensor.inverse();
    let slopes = mesh.points.iter().map(|&p| {
        let p = sensor_from_world * Point3::from(p);
        if p.z > 0.0 { p.x.abs().max(p.y.abs()) / p.z } else { f64::INFINITY }
    });
    let steepest = slopes.fold(0.0, f64::max);
    if steepest > 0.0 && steepest.is_finite() {
        2.0 * (steepest * (1.0 + BORDER)).atan()
    } else {
        std::f64::consts::FRAC_PI_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{cuboid, sphere};

    #[test]
    fn the_target_is_straight_ahead_and_up_is_up() {
        let (position, target) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.5, 4.0, 2.0));
        let sensor_from_world = look_at(position, target, Vector3::z()).inverse();
        let seen = sensor_from_world * Point3::from(target);
        assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && (seen.z - (target - position).norm()).abs() < 1e-12);
        let up = sensor_from_world * Vector3::z();
        assert!(up.x.abs() < 1e-12 && up.y < 0.0);
    }

    #[test]
    fn awkward_directions_still_give_a_rotation() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::zeros()];
        for (target, up) in axes.iter().flat_map(|t| axes.iter().map(move |u| (t, u))) {
            let pose = look_at(Vector3::zeros(), *target, *up);
            assert!((pose.rotation.norm() - 1.0).abs() < 1e-9);
            let ahead = if target.norm() > 0.0 { *target } else { Vector3::x() };
            assert!((pose * Vector3::z() - ahead).norm() < 1e-9, "{target} {up}");
        }
    }

    #[test]
    fn an_orbiting_scanner_frames_the_whole_mesh() {
        for (azimuth, elevation) in [(0.0, 0.0), (2.0, 0.7), (-1.0, -1.5)] {
            let scanner = VirtualScanner::orbit(&sphere(3.0, 4), azimuth, elevation, 3.0, 100);
            let scan = scanner.scan(&sphere(3.0, 4), 0);
            let rows: Vec<u32> = scan.pixels.iter().map(|p| p / 100).collect();
            let (top, bottom) = (*rows.iter().min().unwrap(), *rows.iter().max().unwrap());
            assert!((1..6).contains(&top) && (94..99).contains(&bottom), "{top} {bottom}");
            assert!((scanner.world_from_sensor.translation.vector.norm() - 9.0).abs() < 0.1);
        }
        let within = VirtualScanner::orbit(&cuboid([1.0; 3]), 0.0, 0.0, 0.1, 8);
        assert_eq!(within.horizontal_view, std::f64::consts::FRAC_PI_2);
    }
}
