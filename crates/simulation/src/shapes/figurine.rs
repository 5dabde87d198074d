//! The demo shape: a small statuette without any symmetry.

use super::isosurface::Lattice;
use super::solid::{Bump, Part, Solid};
use crate::Mesh;
use congruent_geometry::random::Stream;
use nalgebra::{Matrix3, Vector3};

/// Height of the figurine along z, say in millimetres.
pub const FIGURINE_HEIGHT: f64 = 100.0;
/// Cell size of the lattice in which the surface is found; gives some 80 000 triangles.
const STEP: f64 = 1.2;
/// Free space between the parts and the lattice's border; no relief rises that high.
const MARGIN: f64 = 6.0;
/// Maximum displacement of joints along each axis.
const JITTER: f64 = 1.5;
/// Corners of the box that holds all parts, however they are displaced.
const LOW: [f64; 3] = [-42.0, -27.0, -5.0];
const HIGH: [f64; 3] = [37.0, 29.0, 106.0];

/// Returns a standing statuette, centred at the origin, 100 units high along z: a robed figure on a base with one arm
/// raised and one across, and on it dozens of bumps, dents and folds of 4 to 25 % of its size. The seed determines the
/// relief and moves the limbs slightly.
///
/// Closed, in one piece and without self-intersections.
#[must_use]
pub fn figurine(seed: u64) -> Mesh {
    let mut stream = Stream::new(seed, 0);
    let mut solid = Solid { parts: parts(&mut stream), bumps: Vec::new() };
    solid.bumps = relief(&solid, &mut stream);
    let mut mesh = lattice().surface(|p| solid.distance(p, MARGIN));
    centred_and_scaled(&mut mesh.points);
    mesh
}

fn lattice() -> Lattice {
    let low = Vector3::from(LOW) - Vector3::repeat(MARGIN);
    let extent = Vector3::from(HIGH) - low + Vector3::repeat(MARGIN);
    let nodes = [extent.x, extent.y, extent.z].map(|side| (side / STEP).ceil() as usize + 1);
    Lattice { low, step: STEP, nodes }
}

/// Returns the parts of every figurine: x to its left, y to its back, z up. No radius is below the sum of the deepest
/// dent and half a cell's diagonal (1.6 + 1.04), so that no dent can cut off a limb.
fn parts(stream: &mut Stream) -> Vec<Part> {
    let mut near = |x: f64, y: f64, z: f64| {
        let mut jitter = || stream.between(-JITTER, JITTER);
        Vector3::new(x + jitter(), y + jitter(), z + jitter())
    };
    let body = |centre, x, y, z| Part::Body { centre, half_axes: Vector3::new(x, y, z) };
    let limb = |from, to, r_from, r_to| Part::Limb { ends: [from, to], radii: [r_from, r_to] };
    let (shoulder, elbow, hand) = (near(-13.0, 1.0, 61.0), near(-27.0, 2.0, 54.0), near(-33.0, -9.0, 74.0));
    let (other_shoulder, other_elbow, other_hand) =
        (near(17.0, 1.0, 61.0), near(27.0, -3.0, 45.0), near(9.0, -18.0, 42.0));
    vec![
        body(near(0.0, 1.0, 3.0), 24.0, 19.0, 6.0),
        limb(near(-1.0, 1.0, 10.0), near(2.0, 0.0, 42.0), 17.0, 11.0),
        body(near(2.0, 0.0, 53.0), 18.0, 12.0, 15.0),
        limb(near(3.0, 0.0, 66.0), near(4.0, -1.0, 75.0), 6.5, 6.0),
        body(near(5.0, -2.0, 83.0), 11.5, 13.0, 12.5),
        limb(near(8.0, -13.0, 83.0), near(9.5, -18.0, 80.5), 3.0, 2.7),
        limb(near(3.0, 2.0, 92.0), near(-5.0, 10.0, 100.0), 7.0, 2.7),
        limb(shoulder, elbow, 6.5, 4.8),
        limb(elbow, hand, 4.8, 3.6),
        body(hand + Vector3::new(0.0, -1.0, 4.0), 5.5, 4.0, 6.5),
        limb(other_shoulder, other_elbow, 6.5, 4.8),
        limb(other_elbow, other_hand, 4.8, 4.0),
        body(near(-4.0, 13.0, 50.0), 10.0, 8.0, 13.0),
    ]
}

/// Draws the relief. Sizes are standard deviations (a bump's visible extent is four of them); heights are fractions of
/// these.
fn relief(solid: &Solid, stream: &mut Stream) -> Vec<Bump> {
    let scales = [(18, [4.0, 6.0], 0.5), (90, [1.8, 3.2], 0.5), (120, [1.1, 1.6], 0.4)];
    let kinds =
        scales.into_iter().flat_map(|(count, widths, steepness)| (0..count).map(move |i| (i, widths, steepness)));
    kinds
        .map(|(i, widths, steepness)| {
            let at = somewhere(solid, stream);
            let width = stream.between(widths[0], widths[1]);
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let height = sign * steepness * width * stream.between(0.7, 1.3);
            // Two of six are folds: narrow across, long along.
            let [across, along] = if i % 6 < 2 { [0.55, 2.4] } else { [1.0, 1.0] };
            let outward = solid.outward(&at);
            let side = outward.cross(&direction(stream)).try_normalize(1e-6).unwrap_or_else(Vector3::x);
            let axes = [side / (across * width), outward.cross(&side) / (along * width), outward / (1.5 * width)];
            Bump { at, axes: Matrix3::from_columns(&axes).transpose(), height }
        })
        .collect()
}

/// Draws a point on the bare surface, all over it but not quite evenly.
fn somewhere(solid: &Solid, stream: &mut Stream) -> Vector3<f64> {
    /// Starting this close keeps the ends of limbs from drawing more than their share.
    const NEAR: f64 = 4.0;
    let mut start = || Vector3::from_fn(|k, _| stream.between(LOW[k], HIGH[k]));
    let mut from = start();
    while solid.bare_distance(&from).abs() > NEAR {
        from = start();
    }
    solid.on_surface(from)
}

fn direction(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal())
}

fn centred_and_scaled(points: &mut [[f64; 3]]) {
    let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.iter().fold(start, |(l, h), p| (l.inf(&Vector3::from(*p)), h.sup(&Vector3::from(*p))));
    let factor = FIGURINE_HEIGHT / (high.z - low.z);
    let centre = (low + high) * 0.5;
    points.iter_mut().for_each(|p| *p = ((Vector3::from(*p) - centre) * factor).into());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::checks::{is_closed, volume};
    use congruent_geometry::{NeighborIndex, narrow};

    /// Returns the number of separate pieces of a mesh.
    fn n_pieces(mesh: &Mesh) -> usize {
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        let mut parent: Vec<u32> = (0..mesh.points.len() as u32).collect();
        for t in &mesh.triangles {
            for k in 1..3 {
                let (a, b) = (root(&mut parent, t[0]), root(&mut parent, t[k]));
                parent[a as usize] = b;
            }
        }
        (0u32..).zip(&parent).filter(|&(i, &p)| i == p).count()
    }

    #[test]
    fn it_is_closed_in_one_piece_and_a_hundred_high_for_every_seed() {
        for seed in 0..10 {
            let mesh = figurine(seed);
            assert!(is_closed(&mesh) && volume(&mesh) > 0.0, "{seed}");
            assert_eq!(n_pieces(&mesh), 1, "{seed}");
            assert!((60_000..100_000).contains(&mesh.triangles.len()), "{seed}: {}", mesh.triangles.len());
            let z = |pick: fn(f64, f64) -> f64, start| mesh.points.iter().map(|p| p[2]).fold(start, pick);
            assert!((z(f64::max, f64::MIN) - 50.0).abs() < 1e-9 && (z(f64::min, f64::MAX) + 50.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_seed_decides_all_of_it() {
        assert_eq!(figurine(3), figurine(3));
        assert_ne!(figurine(3), figurine(4));
    }

    /// Returns the mean distance from a moved figurine to the figurine itself.
    fn misfit(points: &[[f64; 3]], index: &NeighborIndex, motion: impl Fn(Vector3<f64>) -> Vector3<f64>) -> f64 {
        let moved: Vec<Vector3<f64>> = points.iter().step_by(40).map(|&p| motion(p.into())).collect();
        let distance =
            |p: &Vector3<f64>| index.nearest(&narrow(p)).map_or(0.0, |hit| f64::from(hit.distance_sq).sqrt());
        moved.iter().map(distance).sum::<f64>() / moved.len() as f64
    }

    #[test]
    fn no_rotation_about_its_centre_brings_it_back_onto_itself() {
        let points = figurine(1).points;
        let mean = points.iter().map(|&p| Vector3::from(p)).sum::<Vector3<f64>>() / points.len() as f64;
        let points: Vec<[f64; 3]> = points.iter().map(|&p| (Vector3::from(p) - mean).into()).collect();
        let index = NeighborIndex::new(&points.iter().map(|&p| narrow(&p.into())).collect::<Vec<_>>());
        assert!(misfit(&points, &index, |p| p) < 1e-5);
        let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
        for (axis, step) in axes.into_iter().flat_map(|a| (1..12).map(move |s| (a, s))) {
            let turn = nalgebra::Rotation3::from_axis_angle(&axis, f64::from(step) * 30f64.to_radians());
            // The relief is a few percent of the size; with a symmetry the distance would be below the mesh's spacing
            // of half a unit.
            let distance = misfit(&points, &index, |p| turn * p);
            assert!(distance > 1.5, "{axis:?} {step}: {distance}");
        }
    }
}
