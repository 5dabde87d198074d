//! Writes the scan from which the fixtures of `scripts/parity` are made: one view of the figurine, slightly noisy, in
//! the sensor's frame, as bare little-endian `f32` triples on standard output.

use congruent_simulation::scanner::{RangeNoise, VirtualScanner};
use congruent_simulation::shapes::figurine;
use std::io::Write;

/// Image side; gives a few thousand points.
const PIXELS: u32 = 150;
/// Standard deviation of the ranges, in distances between neighbouring points: enough that no two neighbours are
/// equally far away.
const NOISE: f64 = 0.1;

fn main() -> std::io::Result<()> {
    let mesh = figurine(1);
    let mut scanner = VirtualScanner::orbit(&mesh, 0.5, 0.25, 3.5, PIXELS);
    let (centre, _) = mesh.bounding_sphere();
    let distance = (scanner.world_from_sensor.translation.vector - centre).norm();
    scanner.noise = RangeNoise::gaussian(NOISE * scanner.spacing_at(distance));
    let points = scanner.scan(&mesh, 1).points;
    let bytes: Vec<u8> = points.iter().flatten().flat_map(|&v| (v as f32).to_le_bytes()).collect();
    std::io::stdout().write_all(&bytes)
}
