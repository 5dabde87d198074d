//! Reads the tables that `reference.cpp` writes; a module of the tests `parity.rs` of several crates.

use congruent_geometry::{NeighborIndex, Point, Surface};
use std::path::PathBuf;

/// Another directory of tables to compare with, in place of the stored ones.
const ELSEWHERE: &str = "PARITY_TABLES";
const STORED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/parity/fixtures");

fn read(name: &str) -> Vec<u8> {
    let directory = std::env::var_os(ELSEWHERE).map_or_else(|| PathBuf::from(STORED), PathBuf::from);
    let path = directory.join(name);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Rows of a table of numbers.
pub(crate) fn rows<const WIDTH: usize>(name: &str) -> Vec<[f32; WIDTH]> {
    let numbers: Vec<f32> = read(name).as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let (rows, rest) = numbers.as_chunks();
    assert!(rest.is_empty() && !rows.is_empty(), "{name} has rows of {WIDTH}");
    rows.to_vec()
}

/// A table of positions.
pub(crate) fn indices(name: &str) -> Vec<u32> {
    read(name).as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect()
}

/// PCL's resolution of the cloud.
pub(crate) fn resolution() -> f64 {
    String::from_utf8(read("resolution.txt")).unwrap().trim().parse().unwrap()
}

/// Points, in the sensor's frame.
pub(crate) fn points() -> Vec<Point> {
    rows("points.f32")
}

/// The points with PCL's normals and resolution, so that what follows starts from the same.
pub(crate) fn surface() -> Surface {
    let points = points();
    // Where PCL has no normal it writes NaN.
    let valid = |n: &[f32; 4]| if n[0].is_finite() { [n[0], n[1], n[2]] } else { [0.0; 3] };
    let normals = rows("normals20.f32").iter().map(valid).collect();
    let index = NeighborIndex::new(&points);
    Surface::new(points, normals, index, resolution())
}

/// Prints how far apart two results are, and the share of them within `tolerance`, which is returned.
pub(crate) fn share_within(what: &str, tolerance: f64, mut differences: Vec<f64>) -> f64 {
    differences.sort_by(f64::total_cmp);
    let share = differences.iter().filter(|d| **d <= tolerance).count() as f64 / differences.len() as f64;
    let at = |quantile: f64| differences[((differences.len() - 1) as f64 * quantile) as usize];
    println!(
        "{what}: {:.3} % of {} within {tolerance:e}; median {:.1e}, 99 % {:.1e}, largest {:.1e}",
        100.0 * share,
        differences.len(),
        at(0.5),
        at(0.99),
        at(1.0)
    );
    share
}

/// Prints and returns how many are shared, of those found by either.
pub(crate) fn jaccard(what: &str, ours: &[u32], pcls: &[u32]) -> f64 {
    let shared = ours.iter().filter(|i| pcls.contains(i)).count();
    let share = shared as f64 / (ours.len() + pcls.len() - shared).max(1) as f64;
    println!("{what}: {} of ours, {} of PCL's, {shared} shared, Jaccard {share:.4}", ours.len(), pcls.len());
    share
}
