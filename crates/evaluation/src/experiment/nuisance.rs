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

/// The name of the nuisance with its level. Results are told apart by it, so two levels never have the same name (shares
/// of up to 15 significant digits).
impl fmt::Display for Nuisance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Nuisance::None {} => write!(f, "none"),
            Nuisance::Noise(sigma) => write!(f, "noise {sigma} pr"),
            Nuisance::KeepEvenly(share) => write!(f, "evenly {} % kept", percent(share)),
            Nuisance::KeepRandomly(share) => write!(f, "randomly {} % kept", percent(share)),
            Nuisance::Holes(count) => write!(f, "{count} holes"),
            Nuisance::Strays(share) => write!(f, "{} % strays", percent(share)),
        }
    }
}

/// Returns a share in percent. The decimal point of the number as it is written is shifted, because a multiplication by
/// 100 would make 7.000000000000001 of 0.07.
fn percent(share: f64) -> f64 {
    format!("{share}e2").parse().unwrap_or(100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_have_names_of_their_own() {
        for (nuisance, name) in [
            (Nuisance::Strays(0.2), "20 % strays"),
            (Nuisance::Strays(100.0), "10000 % strays"),
            (Nuisance::KeepEvenly(0.07), "evenly 7 % kept"),
            (Nuisance::KeepRandomly(0.29), "randomly 29 % kept"),
            (Nuisance::KeepRandomly(0.005), "randomly 0.5 % kept"),
            (Nuisance::KeepRandomly(0.001), "randomly 0.1 % kept"),
            (Nuisance::KeepRandomly(0.123_456_789_012_345), "randomly 12.3456789012345 % kept"),
            (Nuisance::KeepRandomly(1e-9), "randomly 0.0000001 % kept"),
            (Nuisance::Noise(0.25), "noise 0.25 pr"),
        ] {
            assert_eq!(nuisance.to_string(), name);
        }
        for per_mille in 0..=1000 {
            let expected = f64::from(per_mille) / 10.0;
            assert_eq!(percent(f64::from(per_mille) / 1000.0), expected);
        }
    }
}
