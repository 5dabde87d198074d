//! Makes input of any size, for `scripts/peers/scaling`.
//!
//!     grow scans N FOLDER      two looks at the figurine of about N points each: FOLDER/source.ply and target.ply
//!     grow matches N FILE      N pairs of points as CSV, a tenth of them right

use congruent_io::{write_file, write_scan};
use congruent_simulation::correspondences::{CorrespondenceScene, NearMiss};
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use congruent_simulation::scanner::RangeNoise;
use std::error::Error;
use std::fmt::Write;
use std::path::Path;

/// A look at this many pixels tells how many points a pixel gives.
const TRIAL_PIXELS: u32 = 200;
/// Standard deviation of the ranges in the trial's look, data units; it shrinks with the distance between neighbours.
const TRIAL_NOISE: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["scans", n, folder] => scans(n.parse()?, Path::new(folder)),
        ["matches", n, file] => matches(n.parse()?, Path::new(file)),
        _ => Err("usage: grow scans N FOLDER, or grow matches N FILE".into()),
    }
}

fn scans(n: f64, folder: &Path) -> Result<(), Box<dyn Error>> {
    let trial = looks(TRIAL_PIXELS).source.points.len() as f64;
    let pair = looks((f64::from(TRIAL_PIXELS) * (n / trial).sqrt()).round() as u32);
    write_scan(&folder.join("source.ply"), &pair.source)?;
    write_scan(&folder.join("target.ply"), &pair.target)?;
    Ok(())
}

fn looks(pixels: u32) -> ScanPair {
    let noise = RangeNoise::gaussian(TRIAL_NOISE * f64::from(TRIAL_PIXELS) / f64::from(pixels));
    figurine_pair(&PairOptions { pixels, noise, ..PairOptions::default() })
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
