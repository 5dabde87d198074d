//! Surfaces for tests.

use crate::Keypoint;
use congruent_geometry::random::Stream;
use congruent_geometry::{
    NeighborIndex, Neighborhood, Point, PointNormal, Surface, estimate_normals, narrow, resolution, wide,
};
use nalgebra::Vector3;

/// Points with normals estimated from their twelve nearest points and turned to +z.
pub(crate) fn surface(points: Vec<Point>) -> Surface {
    let index = NeighborIndex::new(&points);
    let normals = estimate_normals(&points, &index, Neighborhood::Nearest(12))
        .iter()
        .map(|n| if n.normal[2] < 0.0 { n.normal.map(|v| -v) } else { n.normal })
        .collect();
    let resolution = resolution(&points, &index).map_or(1.0, |r| r.mean);
    Surface::new(points, normals, index, resolution)
}

/// `side`² points at integer x and y around the origin, with the given heights.
pub(crate) fn height_field(side: u16, height: impl Fn(f64, f64) -> f64) -> Surface {
    let at = |i: u16| f64::from(i) - f64::from(side / 2);
    let points = (0..side * side).map(|i| {
        let (x, y) = (at(i % side), at(i / side));
        narrow(&Vector3::new(x, y, height(x, y)))
    });
    surface(points.collect())
}

/// A flat grid.
pub(crate) fn plane(side: u16) -> Surface {
    height_field(side, |_, _| 0.0)
}

/// `side`² irregular points, one per unit square, over random bumps.
pub(crate) fn bumpy(side: u16, seed: u64) -> Surface {
    let mut stream = Stream::new(seed, 0);
    let half = f64::from(side) / 2.0;
    let bumps: Vec<[f64; 4]> = (0..side)
        .map(|_| {
            let centre = (stream.between(-half, half), stream.between(-half, half));
            [centre.0, centre.1, stream.between(-3.0, 3.0), stream.between(1.5, 4.0)]
        })
        .collect();
    let height = |x: f64, y: f64| -> f64 {
        bumps.iter().map(|[cx, cy, h, w]| h * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * w * w)).exp()).sum()
    };
    let points = (0..side * side).map(|i| {
        let x = f64::from(i % side) + stream.unit() - half;
        let y = f64::from(i / side) + stream.unit() - half;
        narrow(&Vector3::new(x, y, height(x, y)))
    });
    surface(points.collect())
}

/// The same surface in a random orientation.
pub(crate) fn turned(surface: &Surface, seed: u64) -> Surface {
    let turn = Stream::new(seed, 1).rotation();
    let rotated = |all: &[Point]| -> Vec<Point> { all.iter().map(|p| narrow(&(turn * wide(*p)))).collect() };
    let points = rotated(surface.points());
    let index = NeighborIndex::new(&points);
    Surface::new(points, rotated(surface.normals()), index, surface.resolution())
}

pub(crate) fn indices(keypoints: &[Keypoint]) -> Vec<u32> {
    keypoints.iter().map(|k| k.index).collect()
}

/// Number of indices in both lists over the number in either; both lists are ascending.
pub(crate) fn overlap(a: &[u32], b: &[u32]) -> f64 {
    let both = a.iter().filter(|i| b.binary_search(i).is_ok()).count();
    both as f64 / (a.len() + b.len() - both) as f64
}

pub(crate) fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(work)
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
