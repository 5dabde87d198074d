//! Refinement of Harris keypoints: the point where the tangent planes around it meet (Förstner's corner, as in PCL).

use crate::Keypoint;
use congruent_geometry::{PointNormal, Surface, narrow, wide};
use nalgebra::{Matrix3, Vector3};

/// Maximum number of rounds; each uses the neighbourhood of the last position.
const ROUNDS: usize = 10;
/// Planes do not meet in a point if the smallest eigenvalue of their normal matrix is at most this fraction of the
/// largest.
const MIN_CONDITION: f64 = 1e-4;

/// Moves a keypoint to the surface point nearest to where the tangent planes within `radius` meet. It stays if they do
/// not meet, or if their meeting point is farther away than `radius`. `step` is the move, data units, that ends the
/// search.
pub(crate) fn refined(
    surface: &Surface,
    normals: &[PointNormal],
    keypoint: Keypoint,
    radius: f64,
    step: f64,
) -> Keypoint {
    let start = wide(surface.points()[keypoint.index as usize]);
    let mut place = start;
    for _ in 0..ROUNDS {
        let Some(next) = meeting_point(surface, normals, &place, radius) else { break };
        let moved = (next - place).norm();
        place = next;
        if moved <= step {
            break;
        }
    }
    if (place - start).norm() > radius {
        return keypoint;
    }
    match surface.index().nearest(&narrow(&place)) {
        Some(nearest) => Keypoint { index: nearest.index, ..keypoint },
        None => keypoint,
    }
}

/// Returns the least-squares meeting point of the tangent planes around a place: `(Σ n nᵀ)⁻¹ Σ n nᵀ p`.
fn meeting_point(
    surface: &Surface,
    normals: &[PointNormal],
    place: &Vector3<f64>,
    radius: f64,
) -> Option<Vector3<f64>> {
    let (mut planes, mut pull) = (Matrix3::zeros(), Vector3::zeros());
    surface.index().within(&narrow(place), radius, |n| {
        let normal = wide(normals[n.index as usize].normal);
        let offset = wide(surface.points()[n.index as usize]) - place;
        planes += normal * normal.transpose();
        pull += normal * normal.dot(&offset);
    });
    let eigen = planes.symmetric_eigenvalues();
    let is_point = eigen.min() > MIN_CONDITION * eigen.max();
    planes.try_inverse().filter(|_| is_point).map(|inverse| place + inverse * pull)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cube_corner;

    #[test]
    fn a_keypoint_beside_a_corner_moves_to_it() {
        let (surface, normals) = cube_corner(3, 7);
        let beside = (1..surface.len()).find(|&i| surface.points()[i] == [0.0, 1.5, 0.5]).unwrap();
        let keypoint = Keypoint { index: beside as u32, response: 0.03 };
        assert_eq!(refined(&surface, &normals, keypoint, 3.0, 1e-3), Keypoint { index: 0, response: 0.03 });
    }

    #[test]
    fn a_keypoint_on_a_plane_stays() {
        let (surface, normals) = cube_corner(3, 7);
        let inside = (1..surface.len()).find(|&i| surface.points()[i] == [0.0, 5.5, 5.5]).unwrap();
        let keypoint = Keypoint { index: inside as u32, response: 0.0 };
        assert_eq!(refined(&surface, &normals, keypoint, 2.0, 1e-3), keypoint);
    }
}
