//! Round shapes: the sphere, the cylinder and the bowl.

use crate::Mesh;
use nalgebra::Vector3;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Maximum number of subdivisions, with which a sphere has some five million triangles.
const MOST_SUBDIVISIONS: u32 = 9;

/// Returns an icosahedron with each triangle split into four `subdivisions` times (at most nine), and all points pushed
/// out to `radius`; centred at the origin. It has 20·4^subdivisions triangles.
#[must_use]
pub fn sphere(radius: f64, subdivisions: u32) -> Mesh {
    let mut mesh = icosahedron();
    for _ in 0..subdivisions.min(MOST_SUBDIVISIONS) {
        mesh = subdivided(&mesh);
    }
    mesh.points.iter_mut().for_each(|p| *p = p.map(|v| v * radius));
    mesh
}

fn icosahedron() -> Mesh {
    let golden = f64::midpoint(1.0, 5f64.sqrt());
    let signs = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    // Three golden rectangles, each being the previous one with its axes rotated by one.
    let rectangle = |turn: usize| signs.map(|(a, b)| rotated_axes([0.0, a, b * golden], turn));
    let points: Vec<[f64; 3]> = (0..3).flat_map(rectangle).map(|p| Vector3::from(p).normalize().into()).collect();
    let edge_sq = (Vector3::from(points[0]) - Vector3::from(points[1])).norm_squared();
    let near =
        |i: usize, j: usize| (Vector3::from(points[i]) - Vector3::from(points[j])).norm_squared() < 1.5 * edge_sq;
    let mut triangles = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    triangles.push(outward([i, j, k], &points));
                }
            }
        }
    }
    Mesh { points, triangles }
}

fn rotated_axes(p: [f64; 3], turn: usize) -> [f64; 3] {
    std::array::from_fn(|k| p[(k + turn) % 3])
}

fn outward([i, j, k]: [usize; 3], points: &[[f64; 3]]) -> [u32; 3] {
    let [a, b, c] = [i, j, k].map(|i| Vector3::from(points[i]));
    let [i, j, k] = [i, j, k].map(|i| i as u32);
    if a.dot(&b.cross(&c)) > 0.0 { [i, j, k] } else { [i, k, j] }
}

/// Splits each triangle into four at the midpoints of its edges; new points are pushed out to the unit sphere.
fn subdivided(mesh: &Mesh) -> Mesh {
    let mut points = mesh.points.clone();
    let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let sum = Vector3::from(points[a as usize]) + Vector3::from(points[b as usize]);
            points.push(sum.normalize().into());
            points.len() as u32 - 1
        })
    };
    let mut triangles = Vec::with_capacity(mesh.triangles.len() * 4);
    for &[a, b, c] in &mesh.triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    Mesh { points, triangles }
}

/// Returns a closed cylinder around the z axis, centred at the origin, with at least three `segments` around.
#[must_use]
pub fn cylinder(radius: f64, height: f64, segments: u32) -> Mesh {
    let n = segments.max(3);
    let mut points = vec![[0.0, 0.0, -height / 2.0], [0.0, 0.0, height / 2.0]];
    points.extend((0..n).flat_map(|i| {
        let [x, y] = on_circle(radius, i, n);
        [[x, y, -height / 2.0], [x, y, height / 2.0]]
    }));
    let segment = |i: u32| {
        let (low, next_low) = (2 + 2 * i, 2 + 2 * ((i + 1) % n));
        let (high, next_high) = (low + 1, next_low + 1);
        [[0, next_low, low], [1, high, next_high], [low, next_low, next_high], [low, next_high, high]]
    };
    Mesh { points, triangles: (0..n).flat_map(segment).collect() }
}

/// Returns the lower half (z ≤ 0) of a sphere as an open shell without thickness, `segments` around (at least three).
#[must_use]
pub fn bowl(radius: f64, segments: u32) -> Mesh {
    let n = segments.max(3);
    let rings = n.div_ceil(4);
    let mut points = vec![[0.0, 0.0, -radius]];
    for ring in 1..=rings {
        let (sin, cos) = (FRAC_PI_2 * f64::from(ring) / f64::from(rings)).sin_cos();
        points.extend((0..n).map(|i| {
            let [x, y] = on_circle(radius * sin, i, n);
            [x, y, -radius * cos]
        }));
    }
    let mut triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1 + (i + 1) % n, 1 + i]).collect();
    for ring in 1..rings {
        let (inner, outer) = (1 + (ring - 1) * n, 1 + ring * n);
        triangles.extend((0..n).flat_map(|i| {
            let next = (i + 1) % n;
            [[inner + i, outer + next, outer + i], [inner + i, inner + next, outer + next]]
        }));
    }
    Mesh { points, triangles }
}

fn on_circle(radius: f64, i: u32, n: u32) -> [f64; 2] {
    let (sin, cos) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
    [radius * cos, radius * sin]
}
