//! The scans placed by their poses, as one cloud with one colour per scan.

use crate::commands::{Reading, load_as};
use anyhow::Result;
use congruent_geometry::{RigidTransform, voxel_centroids, wide};
use congruent_io::write_coloured_ply;
use nalgebra::Point3;
use std::path::{Path, PathBuf};

/// Fraction of the colour circle from one scan to the next: with the golden ratio, no two of a few colours are alike.
const TURN: f64 = 0.618_033_988_749_895;

/// Returns the colour of the `i`-th scan.
pub(super) fn colour(i: usize) -> [u8; 3] {
    let hue = (0.58 + TURN * i as f64).fract() * 6.0;
    // Alternately darker and lighter, so that neighbours on the circle differ.
    let value = [0.85, 0.65, 0.95][i % 3];
    let channel = |offset: f64| {
        let k = (offset + hue) % 6.0;
        let part = k.min(4.0 - k).clamp(0.0, 1.0);
        (255.0 * value * (1.0 - 0.75 * part)) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// Writes the scans in one frame. With `voxel` (data units), each scan is thinned to one point per cell.
pub(super) fn write(
    path: &Path,
    scans: &[(usize, PathBuf, RigidTransform)],
    reading: Reading,
    voxel: Option<f64>,
) -> Result<()> {
    let (mut points, mut colours) = (Vec::new(), Vec::new());
    for (at, file, frame_from_scan) in scans {
        points.extend(placed(file, reading, frame_from_scan, voxel)?);
        colours.resize(points.len(), colour(*at));
    }
    Ok(write_coloured_ply(path, &points.into(), &colours)?)
}

fn placed(
    file: &Path,
    reading: Reading,
    frame_from_scan: &RigidTransform,
    voxel: Option<f64>,
) -> Result<Vec<[f64; 3]>> {
    let scan = load_as(file, reading)?.scan;
    let origin = *scan.origin();
    let thinned = voxel.map(|leaf| voxel_centroids(scan.points(), None, leaf).points);
    let points = thinned.as_deref().unwrap_or(scan.points()).iter();
    Ok(points.map(|p| (frame_from_scan * Point3::from(wide(*p) + origin)).coords.into()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_have_different_colours() {
        for i in 0..40 {
            for j in i + 1..i + 6 {
                let off: u32 = colour(i).iter().zip(colour(j)).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
                assert!(off > 60, "{i} {j}: {:?} {:?}", colour(i), colour(j));
            }
        }
    }
}
