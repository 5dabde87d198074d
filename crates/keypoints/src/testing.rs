//! What tests of several detectors need.

use crate::Keypoint;
use congruent_geometry::{Point, PointNormal, Surface};
use congruent_simulation::testing::surface;

pub(crate) fn indices(keypoints: &[Keypoint]) -> Vec<u32> {
    keypoints.iter().map(|k| k.index).collect()
}

/// Number of indices in both lists over the number in either; both lists are ascending.
pub(crate) fn overlap(a: &[u32], b: &[u32]) -> f64 {
    let both = a.iter().filter(|i| b.binary_search(i).is_ok()).count();
    both as f64 / (a.len() + b.len() - both) as f64
}

/// Points of the first `n_faces` faces of a cube around its corner: first the corner itself, which has no normal, then
/// for each face `side` by `side` points, one apart, with the normal of the face.
pub(crate) fn cube_corner(n_faces: usize, side: u8) -> (Surface, Vec<PointNormal>) {
    let mut points: Vec<Point> = vec![[0.0; 3]];
    let mut normals = vec![PointNormal::default()];
    for face in 0..n_faces {
        for i in 0..side * side {
            let mut point = [0.0; 3];
            point[(face + 1) % 3] = 0.5 + f32::from(i % side);
            point[(face + 2) % 3] = 0.5 + f32::from(i / side);
            points.push(point);
            let mut normal = [0.0; 3];
            normal[face] = 1.0;
            normals.push(PointNormal { normal, curvature: 0.0 });
        }
    }
    (surface(points), normals)
}
