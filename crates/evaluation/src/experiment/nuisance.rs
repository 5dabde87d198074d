//! Nuisances that are applied to a scan before the chain runs.

use congruent_geometry::RawScan;
use congruent_simulation::nuisances::{add_noise, add_strays, cut_holes, decimate_uniform, keep_random};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// One level of one nuisance. Lengths are in mean resolutions of the pair without nuisances, as provided.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nuisance {
    /// No nuisance.
    None {},
    /// Adds independent normal noise to each coordinate; the standard deviation in `pr`.
    Noise(#[serde(deserialize_with = "congruent_geometry::numbers::not_negative")] f64),
    /// Keeps this fraction of the points, evenly in space.
    KeepEvenly(#[serde(deserialize_with = "congruent_geometry::numbers::share")] f64),
    /// Keeps this fraction of the points, at random.
    KeepRandomly(#[serde(deserialize_with = "congruent_geometry::numbers::share")] f64),
    /// Cuts this many holes, fewer than a hundred, each of 1 % of the points and at least 20.
    Holes(#[serde(deserialize_with = "holes")] usize),
    /// Adds this many times as many points at random, in the bounding box and a little around it; at most a hundred
    /// times.
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
    /// Returns the scan with the nuisance; `pr` in data units.
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
