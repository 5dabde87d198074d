//! Vertex normals of triangle meshes.

use crate::{Point, narrow, wide};
use nalgebra::Vector3;

/// Returns the unit normal of every point from the triangles around it, each weighted by its angle at the point.
///
/// A normal points to the side from which the corners run counter-clockwise. It is zero for points without a proper
/// triangle.
///
/// # Panics
/// If a triangle refers to a point outside of `points`.
#[must_use]
pub fn vertex_normals(points: &[Point], triangles: &[[u32; 3]]) -> Vec<Point> {
    let mut sums = vec![Vector3::zeros(); points.len()];
    for triangle in triangles {
        let corners = triangle.map(|i| wide(points[i as usize]));
        let Some(normal) = face_normal(&corners) else { continue };
        for (k, &i) in triangle.iter().enumerate() {
            let to_next = corners[(k + 1) % 3] - corners[k];
            let to_last = corners[(k + 2) % 3] - corners[k];
            sums[i as usize] += normal * to_next.angle(&to_last);
        }
    }
    sums.iter().map(|sum| narrow(&sum.try_normalize(1e-6).unwrap_or_default())).collect()
}

/// Returns the unit normal, or `None` for a triangle of which twice the area is at most 1e-12 of its longest edge
/// squared.
fn face_normal(corners: &[Vector3<f64>; 3]) -> Option<Vector3<f64>> {
    let [a, b, c] = corners;
    let cross = (b - a).cross(&(c - a));
    let longest_sq = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    (cross.norm() > 1e-12 * longest_sq).then(|| cross.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_corner_points_along_its_diagonal_however_its_faces_are_cut() {
        // Three faces of a cube meet at the origin; one of them is cut into two triangles there.
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]];
        let triangles = [[0, 4, 1], [0, 2, 4], [0, 1, 3], [0, 3, 2]];
        let normal = wide(vertex_normals(&points, &triangles)[0]);
        assert!((normal + Vector3::repeat(1.0 / 3f64.sqrt())).norm() < 1e-6, "{normal}");
    }

    #[test]
    fn slivers_and_lone_points_give_nothing() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0, 5.0, 5.0]];
        assert_eq!(vertex_normals(&points, &[[0, 1, 2]]), [[0.0; 3]; 4]);
    }
}
