//! Creates input of any size, for `scripts/peers/scaling`.
//!
//!     grow scans N FOLDER           two scans of the figurine of about N points each: FOLDER/source.ply and target.ply
//!     grow tiles N DATASET FOLDER   the same from the first pair of a data set, repeated side by side for N points
//!     grow looks N COUNT FOLDER     COUNT scans of about N points from all around: FOLDER/000.ply, …
//!     grow matches N FILE           N pairs of points as CSV, a tenth of them right

use congruent_geometry::random::Stream;
use congruent_geometry::{RawScan, RigidTransform};
use congruent_io::{read_dataset, read_scan, write_file, write_scan};
use congruent_simulation::correspondences::{CorrespondenceScene, NearMiss};
use congruent_simulation::nuisances::moved;
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use congruent_simulation::scanner::RangeNoise;
use nalgebra::{Translation3, Vector3};
use std::error::Error;
use std::fmt::Write;
use std::path::Path;

/// Image side of a trial scan, which shows how many points an image gives.
const TRIAL_PIXELS: u32 = 200;
/// Standard deviation of the ranges in the trial scan, data units; it is scaled with the distance between neighbours.
const TRIAL_NOISE: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["scans", n, folder] => scans(n.parse()?, Path::new(folder)),
        ["tiles", n, dataset, folder] => tiles(n.parse()?, Path::new(dataset), Path::new(folder)),
        ["looks", n, count, folder] => around(n.parse()?, count.parse()?, Path::new(folder)),
        ["matches", n, file] => matches(n.parse()?, Path::new(file)),
        _ => Err("usage: grow scans N FOLDER, tiles N DATASET FOLDER, looks N COUNT FOLDER, or matches N FILE".into()),
    }
}

fn scans(n: f64, folder: &Path) -> Result<(), Box<dyn Error>> {
    let pair = looks(pixels(n), 0.0);
    write_pair(&pair.source, &pair.target, folder)
}

fn write_pair(source: &RawScan, target: &RawScan, folder: &Path) -> Result<(), Box<dyn Error>> {
    write_scan(&folder.join("source.ply"), source)?;
    write_scan(&folder.join("target.ply"), target)?;
    Ok(())
}

/// Each tile is rotated differently, so that only one pose fits all of them.
fn tiles(n: usize, dataset: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let pair = read_dataset(dataset, None)?.pairs.remove(0);
    let (source, target) = (read_scan(&pair.source_file)?, read_scan(&pair.target_file)?);
    let source = moved(&source, &pair.target_from_source);
    let middle = target.points.iter().map(Vector3::from).sum::<Vector3<f64>>() / target.points.len() as f64;
    let reach = |scan: &RawScan| scan.points.iter().map(|p| (Vector3::from(p) - middle).norm()).fold(0.0, f64::max);
    let side = 2.0 * reach(&source).max(reach(&target));
    let count = n.div_ceil(target.points.len());
    let along = (count as f64).sqrt().ceil() as usize;
    let mut stream = Stream::new(1, 0);
    let places: Vec<RigidTransform> = (0..count)
        .map(|tile| {
            let place = Vector3::new((tile % along) as f64, (tile / along) as f64, 0.0) * side;
            let turned = RigidTransform::from_parts(Translation3::identity(), stream.rotation());
            Translation3::from(place) * turned * Translation3::from(-middle)
        })
        .collect();
    let tiled = |scan: &RawScan| {
        let points = places.iter().flat_map(|place| moved(scan, place).points);
        RawScan { points: points.collect(), ..RawScan::default() }
    };
    let motion = RigidTransform::from_parts(Translation3::from(Vector3::repeat(side)), stream.rotation());
    write_pair(&moved(&tiled(&source), &motion), &tiled(&target), folder)
}

fn around(n: f64, count: usize, folder: &Path) -> Result<(), Box<dyn Error>> {
    let pixels = pixels(n);
    for i in 0..count {
        let azimuth = std::f64::consts::TAU * i as f64 / count as f64;
        write_scan(&folder.join(format!("{i:03}.ply")), &looks(pixels, azimuth).source)?;
    }
    Ok(())
}

/// Returns the image side that gives about `n` points.
fn pixels(n: f64) -> u32 {
    let trial = looks(TRIAL_PIXELS, 0.0).source.points.len() as f64;
    (f64::from(TRIAL_PIXELS) * (n / trial).sqrt()).round() as u32
}

fn looks(pixels: u32, azimuth: f64) -> ScanPair {
    let noise = RangeNoise::gaussian(TRIAL_NOISE * f64::from(TRIAL_PIXELS) / f64::from(pixels));
    figurine_pair(&PairOptions { pixels, noise, azimuth, ..PairOptions::default() })
}

fn matches(n: usize, file: &Path) -> Result<(), Box<dyn Error>> {
    let scene = CorrespondenceScene { n, inlier_share: 0.1, near_miss_share: 0.2, near_miss: NearMiss::Random };
    let made = scene.generate(1);
    let mut text = String::from("sx,sy,sz,tx,ty,tz\n");
    for (p, q) in made.source.iter().zip(&made.target) {
        writeln!(text, "{},{},{},{},{},{}", p[0], p[1], p[2], q[0], q[1], q[2])?;
    }
    Ok(write_file(file, text.as_bytes())?)
}
