//! What a scan is spoilt with before anything else happens.

use congruent_geometry::RawScan;
use congruent_simulation::nuisances::{add_noise, add_strays, cut_holes, decimate_uniform, keep_random};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// One level of one nuisance. Lengths are in resolutions of the unspoilt pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nuisance {
    /// The scan as it is.
    None {},
    /// Independent normal noise on each coordinate, of this standard deviation in `pr`.
    Noise(#[serde(deserialize_with = "congruent_geometry::numbers::not_negative")] f64),
    /// Keep this share of the points, evenly in space.
    KeepEvenly(#[serde(deserialize_with = "congruent_geometry::numbers::share")] f64),
    /// Keep this share of the points, at random.
    KeepRandomly(#[serde(deserialize_with = "congruent_geometry::numbers::share")] f64),
    /// Cut so many holes of 1 % of the points each: fewer than a hundred.
    Holes(#[serde(deserialize_with = "holes")] usize),
    /// Add so many times as many points at random, in the bounding box and a little around it: at most a hundred times.
    Strays(#[serde(deserialize_with = "times")] f64),
}

fn holes<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    match usize::deserialize(from)? {
        count @ ..100 => Ok(count),
        count => Err(D::Error::custom(format!("{count} holes of 1 % leave nothing: write a number below 100"))),
    }
}

fn times<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    match f64::deserialize(from)? {
        times if (0.0..=100.0).contains(&times) => Ok(times),
        times => Err(D::Error::custom(format!("{times} is out of range: write a number from 0 to 100"))),
    }
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
