//! Built-in shapes.
//!
//! [`figurine`] has no symmetry and has relief at several scales, so that partial views of it can be registered. The
//! others are symmetric shapes on which registration has no unique answer, and [`room`] is a scene seen from within.

mod building;
mod figurine;
mod isosurface;
mod room;
mod round;
mod solid;

pub use building::{corridor, facade};
pub use figurine::{FIGURINE_HEIGHT, figurine};
pub use room::{ROOM_SIZE, room};
pub use round::{bowl, cylinder, sphere};

use crate::Mesh;

/// Returns a square of the given side length in the plane z = 0, centred, facing +z, of `n` × `n` cells (at least one).
#[must_use]
pub fn plane(size: f64, n: u32) -> Mesh {
    let n = n.max(1);
    let at = |i: u32| size * (f64::from(i) / f64::from(n) - 0.5);
    let points = (0..=n).flat_map(|row| (0..=n).map(move |column| [at(column), at(row), 0.0])).collect();
    let cell = |row: u32, column: u32| {
        let (low, high) = (row * (n + 1) + column, (row + 1) * (n + 1) + column);
        [[low, low + 1, high + 1], [low, high + 1, high]]
    };
    let triangles = (0..n).flat_map(|row| (0..n).flat_map(move |column| cell(row, column))).collect();
    Mesh { points, triangles }
}

/// Returns a closed box with the given side lengths, centred at the origin.
#[must_use]
pub fn cuboid(size: [f64; 3]) -> Mesh {
    let half = size.map(|s| s / 2.0);
    // Bit k of a corner's number is its side on axis k.
    let corner = |i: usize| std::array::from_fn(|k| if (i >> k) & 1 == 1 { half[k] } else { -half[k] });
    let faces: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { points: (0..8).map(corner).collect(), triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::checks::{is_closed, volume};
    use nalgebra::Vector3;
    use std::f64::consts::PI;

    #[test]
    fn closed_shapes_are_closed_and_enclose_their_volume() {
        let check = |name: &str, mesh: &Mesh, expected: f64, tolerance: f64| {
            assert!(is_closed(mesh), "{name}");
            assert!((volume(mesh) / expected - 1.0).abs() < tolerance, "{name}: {}", volume(mesh));
        };
        check("cuboid", &cuboid([2.0, 3.0, 4.0]), 24.0, 1e-12);
        // Flat facets cut off the bulge: the missing fraction falls with the square of their size.
        check("sphere", &sphere(2.0, 4), 32.0 / 3.0 * PI, 0.01);
        check("cylinder", &cylinder(2.0, 5.0, 100), 20.0 * PI, 0.01);
        check("smallest cylinder", &cylinder(1.0, 1.0, 0), 0.75 * 3f64.sqrt(), 1e-12);
    }

    #[test]
    fn open_shapes_face_outwards() {
        let normal = |mesh: &Mesh, t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| Vector3::from(mesh.points[i as usize]));
            (b - a).cross(&(c - a))
        };
        let flat = plane(6.0, 3);
        assert_eq!((flat.points.len(), flat.triangles.len()), (16, 18));
        assert!(flat.triangles.iter().all(|t| (normal(&flat, t) - Vector3::new(0.0, 0.0, 4.0)).norm() < 1e-12));
        let bowl = bowl(3.0, 24);
        assert!(bowl.points.iter().all(|p| p[2] < 1e-12 && (Vector3::from(*p).norm() - 3.0).abs() < 1e-12));
        for t in &bowl.triangles {
            assert!(normal(&bowl, t).dot(&Vector3::from(bowl.points[t[0] as usize])) > 0.0);
        }
    }
}
