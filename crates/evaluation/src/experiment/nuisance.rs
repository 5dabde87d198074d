//! What a scan is spoilt with before anything else happens.

use congruent_geometry::RawScan;
use congruent_simulation::nuisances::{add_noise, add_strays, cut_holes, decimate_uniform, keep_random};
use serde::{Deserialize, Serialize};
use std::fmt;

/// One level of one nuisance. Lengths are in resolutions of the unspoilt pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nuisance {
    /// The scan as it is.
    None {},
    /// Independent normal noise on each coordinate, of this standard deviation in `pr`.
    Noise(f64),
    /// Keep this share of the points, evenly in space.
    KeepEvenly(f64),
    /// Keep this share of the points, at random.
    KeepRandomly(f64),
    /// Cut so many holes of 1 % of the points each.
    Holes(usize),
    /// Add so many times as many points at random, in the bounding box and a little around it.
    Strays(f64),
}

impl Nuisance {
    /// The spoilt scan; `pr` in data units.
    #[must_use]
    pub fn apply(&self, scan: &RawScan, pr: f64, seed: u64) -> RawScan {
        match *self {
            Nuisance::None {} => scan.clone(),
            Nuisance::Noise(sigma) => add_noise(scan, sigma * pr, seed),
            Nuisance::KeepEvenly(share) => decimate_uniform(scan, share),
            Nuisance::KeepRandomly(share) => keep_random(scan, share, seed),
            Nuisance::Holes(count) => cut_holes(scan, count, seed),
            Nuisance::Strays(share) => add_strays(scan, share, seed),
        }
    }
}

impl fmt::Display for Nuisance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Nuisance::None {} => write!(f, "none"),
            Nuisance::Noise(sigma) => write!(f, "noise {sigma} pr"),
            Nuisance::KeepEvenly(share) => write!(f, "evenly {:.0} % kept", 100.0 * share),
            Nuisance::KeepRandomly(share) => write!(f, "randomly {:.0} % kept", 100.0 * share),
            Nuisance::Holes(count) => write!(f, "{count} holes"),
            Nuisance::Strays(share) => write!(f, "{:.0} % strays", 100.0 * share),
        }
    }
}
