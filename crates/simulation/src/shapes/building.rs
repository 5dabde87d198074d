//! Parts of buildings that look the same from several places.

use super::{cuboid, plane};
use crate::Mesh;

/// Returns a passage along the x axis, centred, open at both ends: floor, ceiling and two walls, facing inwards.
#[must_use]
pub fn corridor(length: f64, width: f64, height: f64) -> Mesh {
    let mut mesh = cuboid([length, width, height]).inside_out();
    // A wall across the passage has the same x in all its corners.
    let points = mesh.points.clone();
    let x = |i: u32| points[i as usize][0];
    mesh.triangles.retain(|[a, b, c]| (x(*a) - x(*b)).abs() > 0.0 || (x(*a) - x(*c)).abs() > 0.0);
    mesh
}

/// Returns a wall in the plane z = 0 that faces +z, with `columns` × `rows` equal bays that stand out from it, one unit
/// apart; centred. A translation by one unit maps all bays but one column onto bays.
#[must_use]
pub fn facade(columns: u32, rows: u32) -> Mesh {
    let bay = cuboid([0.55, 0.6, 0.3]);
    let mut mesh = plane(f64::from(columns.max(rows) + 1), 1);
    for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
        let at = [f64::from(column) - f64::from(columns - 1) / 2.0, f64::from(row) - f64::from(rows - 1) / 2.0, 0.15];
        let mut bay = bay.clone();
        bay.points.iter_mut().flat_map(|p| p.iter_mut().zip(at)).for_each(|(value, offset)| *value += offset);
        mesh.append(&bay);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corridor_is_open_at_both_ends() {
        let mesh = corridor(20.0, 2.0, 3.0);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (8, 8));
        let spans_x = |t: &[u32; 3]| t.map(|i| mesh.points[i as usize][0]).windows(2).any(|w| w[0] != w[1]);
        assert!(mesh.triangles.iter().all(spans_x));
    }

    #[test]
    fn a_facade_repeats_itself() {
        let mesh = facade(5, 3);
        assert_eq!(mesh.points.len(), 4 + 15 * 8);
        // All corners of the first column, shifted by one, are corners of the second.
        for p in mesh.points[4..].iter().filter(|p| p[0] < -1.5) {
            let close = |q: &&[f64; 3]| (0..3).all(|k| (q[k] - p[k] - [1.0, 0.0, 0.0][k]).abs() < 1e-12);
            assert!(mesh.points.iter().any(|q| close(&q)), "{p:?}");
        }
    }
}
