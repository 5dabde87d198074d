//! Pairs of scans whose surfaces leave the pose undetermined: no program can know the answer, and an honest one says
//! so.

use crate::Mesh;
use crate::nuisances::moved;
use crate::scanner::{RangeNoise, VirtualScanner, look_at};
use crate::shapes::{bowl, corridor, cuboid, cylinder, facade, plane, sphere};
use congruent_geometry::random::Stream;
use congruent_geometry::{RawScan, RigidTransform};
use nalgebra::{Translation3, Vector3};
use std::f64::consts::TAU;

/// Size of all shapes, data units.
const SIZE: f64 = 100.0;
/// Image side of a single view, and of each view from which a whole surface is assembled.
const LOOK_PIXELS: u32 = 160;
const WHOLE_PIXELS: u32 = 100;
/// Noise of the ranges as a fraction of the size: from next to none to more than the distance between points.
const NOISES: [f64; 3] = [0.0002, 0.001, 0.004];

/// The shape that leaves the pose undetermined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Slides and rotates in itself.
    Plane,
    /// Rotates about its centre.
    Sphere,
    /// Slides along its axis and rotates about it.
    Cylinder,
    /// Rotates about its axis, seen from within.
    Bowl,
    /// Slides along itself, scanned from within.
    Corridor,
    /// A whole box: four rotations map it onto itself.
    Box,
    /// A whole prism of six sides: twelve rotations.
    Prism,
    /// A wall of equal bays, cut from a longer one: translations by one bay fit nearly as well.
    Facade,
}

impl Subject {
    /// All subjects.
    pub const ALL: [Subject; 8] = [
        Subject::Plane,
        Subject::Sphere,
        Subject::Cylinder,
        Subject::Bowl,
        Subject::Corridor,
        Subject::Box,
        Subject::Prism,
        Subject::Facade,
    ];
}

/// Returns two scans of a subject, source and target, each under a random motion of its own. `variant` determines views
/// and noise.
#[must_use]
pub fn ambiguous_pair(subject: Subject, variant: u64) -> [RawScan; 2] {
    let mut stream = Stream::new(variant, subject as u64);
    let noise = RangeNoise::gaussian(SIZE * NOISES[(variant % NOISES.len() as u64) as usize]);
    let turn = stream.between(0.3, 0.7);
    [0.0, turn].map(|turn| {
        let scan = scan(subject, turn, noise, &mut stream);
        let shift = Translation3::from(Vector3::from_fn(|_, _| stream.between(-5.0, 5.0) * SIZE));
        moved(&scan, &RigidTransform::from_parts(shift, stream.rotation()))
    })
}

fn scan(subject: Subject, turn: f64, noise: RangeNoise, stream: &mut Stream) -> RawScan {
    let seed = stream.below(u32::MAX).into();
    let half = SIZE / 2.0;
    let look = |mesh: &Mesh, elevation: f64| {
        let scanner = VirtualScanner::orbit(mesh, turn, elevation, 3.0, LOOK_PIXELS);
        VirtualScanner { noise, ..scanner }.scan(mesh, seed).cloud()
    };
    match subject {
        Subject::Plane => look(&plane(SIZE, 2), 1.0),
        Subject::Sphere => look(&sphere(half, 5), 0.4),
        Subject::Cylinder => beside(&cylinder(half / 2.0, 8.0 * SIZE, 120), turn, noise, seed),
        Subject::Bowl => look(&bowl(half, 120), 1.2),
        Subject::Corridor => within(&corridor(40.0 * SIZE, SIZE, SIZE), turn, noise, seed),
        Subject::Box => whole(&cuboid([SIZE, 0.7 * SIZE, 0.45 * SIZE]), noise, seed),
        Subject::Prism => whole(&cylinder(half, 0.8 * SIZE, 6), noise, seed),
        Subject::Facade => before_a_wall(turn, noise, seed),
    }
}

/// Scans a pipe from close by, with its ends out of sight.
fn beside(mesh: &Mesh, turn: f64, noise: RangeNoise, seed: u64) -> RawScan {
    let at = Vector3::new(turn.cos(), turn.sin(), turn) * SIZE;
    let scanner = VirtualScanner::orbit(mesh, 0.0, 0.0, 0.0, LOOK_PIXELS);
    let world_from_sensor = look_at(at, Vector3::new(0.0, 0.0, at.z), Vector3::z());
    VirtualScanner { world_from_sensor, horizontal_view: 0.8, noise, ..scanner }.scan(mesh, seed).cloud()
}

/// Scans a passage from its middle, with the ends out of sight.
fn within(mesh: &Mesh, turn: f64, noise: RangeNoise, seed: u64) -> RawScan {
    let at = Vector3::new(SIZE * turn, 0.1 * SIZE * turn, 0.0);
    let scanner = VirtualScanner::orbit(mesh, 0.0, 0.0, 0.0, LOOK_PIXELS);
    let scanner = VirtualScanner {
        world_from_sensor: look_at(at, at + Vector3::new(1.0, 1.2 + 0.3 * turn, 0.1), Vector3::z()),
        noise,
        ..scanner
    };
    scanner.scan(mesh, seed).cloud()
}

/// Scans a surface from all around, in its own frame.
fn whole(mesh: &Mesh, noise: RangeNoise, seed: u64) -> RawScan {
    let looks = (0..6u64).map(|look| {
        let elevation = if look % 2 == 0 { 0.7 } else { -0.7 };
        let scanner = VirtualScanner::orbit(mesh, TAU * look as f64 / 6.0 + 0.2, elevation, 3.0, WHOLE_PIXELS);
        let scan = VirtualScanner { noise, ..scanner }.scan(mesh, seed.wrapping_add(look));
        moved(&scan.cloud(), &scan.world_from_sensor)
    });
    RawScan { points: looks.flat_map(|scan| scan.points).collect(), ..RawScan::default() }
}

/// Scans a part of a long wall, six bays wide; where it begins depends on `turn`.
fn before_a_wall(turn: f64, noise: RangeNoise, seed: u64) -> RawScan {
    let bay = SIZE / 6.0;
    let mut mesh = facade(14, 3);
    mesh.points.iter_mut().flatten().for_each(|value| *value *= bay);
    let at = Vector3::new(bay * (4.0 * turn - 1.0), bay * (turn - 0.4), 1.4 * SIZE);
    let scanner = VirtualScanner::orbit(&mesh, 0.0, 0.0, 0.0, 2 * LOOK_PIXELS);
    let world_from_sensor = look_at(at, at - Vector3::z() * SIZE, Vector3::y());
    let mut scan = VirtualScanner { world_from_sensor, noise, ..scanner }.scan(&mesh, seed).cloud();
    // Only the middle, without the edges of the wall or of the image.
    scan.points.edited().retain(|p| p[0].abs() < 0.5 * SIZE && p[1].abs() < 0.25 * SIZE);
    scan
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subject_has_enough_points_and_repeats() {
        for subject in Subject::ALL {
            for variant in 0..3 {
                let pair = ambiguous_pair(subject, variant);
                assert!(pair.iter().all(|scan| scan.points.len() > 3000), "{subject:?}: {}", pair[0].points.len());
                assert_eq!(pair, ambiguous_pair(subject, variant));
            }
        }
    }
}
