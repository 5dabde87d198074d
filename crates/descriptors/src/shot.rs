//! SHOT, signatures of histograms of orientations (Tombari, Salti and Di Stefano 2010; details as in PCL).
//!
//! The sphere around a keypoint is divided along its own axes into 8 sectors × 2 shells × 2 halves. Each of the 32
//! volumes holds a histogram of the cosines between the normals in it and the z axis.

use crate::Descriptor;
use crate::frames::shot_frame;
use crate::neighborhood::{Near, with_neighborhood};
use congruent_geometry::{Length, Surface, wide};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Number of bins for the cosine from −1 to 1; the outer two are half as wide.
const COSINES: usize = 11;
/// Number of volumes, 8 sectors × 2 shells × 2 halves; a volume has number `4·sector + 2·outer + upper`.
const VOLUMES: usize = 32;
const DIM: usize = VOLUMES * COSINES;
/// Coordinates in the frame smaller than this are taken as zero; PCL's number.
const NOTHING: f64 = 1e-30;
/// Distance up to which a neighbour has no direction; PCL's number.
const MIN_DISTANCE: f64 = 1e-15;

/// `[descriptor.shot]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct ShotConfig {
    /// Radius of the neighbourhood and of the frame; 15 pr in Yang et al.
    pub radius: Length,
    /// Whether what belongs to the topmost cosine bin spills from the one below into the lowest bin, as in PCL by
    /// mistake.
    pub pcl_wrap: bool,
}

impl Default for ShotConfig {
    fn default() -> Self {
        ShotConfig { radius: Length::Resolutions(15.0), pcl_wrap: false }
    }
}

impl ShotConfig {
    /// Builds the descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Shot {
        Shot { radius: self.radius.resolve(resolution), pcl_wrap: self.pcl_wrap }
    }
}

/// 352 numbers, none negative, of Euclidean length 1. Needs five neighbours, one of them with a normal; the sign of the
/// normals matters.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Radius of the neighbourhood and of the frame, data units.
    pub radius: f64,
    /// Whether what belongs to the topmost cosine bin spills from the one below into the lowest bin.
    pub pcl_wrap: bool,
}

impl Descriptor for Shot {
    fn dim(&self) -> usize {
        DIM
    }

    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool {
        with_neighborhood(surface, keypoint, self.radius, |neighbors| {
            self.histogram(surface, neighbors).is_some_and(|histogram| normalize_into(&histogram, row))
        })
    }
}

impl Shot {
    /// Returns the histogram before normalisation; `None` without a frame.
    fn histogram(&self, surface: &Surface, neighbors: &[Near]) -> Option<[f64; DIM]> {
        let axes = shot_frame(neighbors, self.radius)?.axes;
        let z = axes.row(2).transpose();
        let mut histogram = [0.0; DIM];
        for near in neighbors {
            let normal = wide(surface.normals()[near.index as usize]);
            if normal != Vector3::zeros() && near.distance > MIN_DISTANCE {
                let local = (axes * near.offset).map(|v| if v.abs() < NOTHING { 0.0 } else { v });
                self.deposit(&local, near.distance, normal.dot(&z), &mut histogram);
            }
        }
        Some(histogram)
    }

    /// Adds one neighbour: for each of cosine, shell, half and sector, the adjacent bin gets its share, and the own bin
    /// what is left of 1.
    fn deposit(&self, local: &Vector3<f64>, distance: f64, cosine: f64, histogram: &mut [f64; DIM]) {
        let azimuth = local.y.atan2(local.x);
        let sector = (((azimuth + PI) / FRAC_PI_4) as usize).min(7);
        let outer = distance > self.radius / 2.0;
        let upper = local.z > 0.0;
        let volume = 4 * sector + 2 * usize::from(outer) + usize::from(upper);

        let (bin, along_cosine) = self.cosine_split(cosine);
        let in_volume = |split: Split| Split { other: split.other.map(|v| v * COSINES + bin), ..split };
        let on_axis = local.x == 0.0 && local.y == 0.0;
        let splits = [
            Some(Split { other: along_cosine.other.map(|b| volume * COSINES + b), ..along_cosine }),
            Some(in_volume(self.shell_split(distance, outer, volume))),
            Some(in_volume(half_split(local.z / distance, upper, volume))),
            (!on_axis).then(|| in_volume(sector_split(azimuth, sector, volume))),
        ];
        for split in splits.into_iter().flatten() {
            histogram[volume * COSINES + bin] += 1.0 - split.share;
            if let Some(other) = split.other {
                histogram[other] += split.share;
            }
        }
    }

    /// Returns the cosine's bin and the split with the adjacent bin on its side.
    fn cosine_split(&self, cosine: f64) -> (usize, Split) {
        let place = 5.0 * (1.0 + cosine.clamp(-1.0, 1.0));
        let bin = (place + 0.5).floor();
        let delta = place - bin;
        let bin = bin as usize;
        let other = match delta {
            d if d > 0.0 && self.pcl_wrap => Some((bin + 1) % (COSINES - 1)),
            d if d > 0.0 => Some(bin + 1),
            d if d < 0.0 => Some(bin - 1),
            _ => None,
        };
        (bin, Split { share: delta.abs(), other })
    }

    /// Splits between the shells, whose middles are at a quarter and three quarters of the radius.
    fn shell_split(&self, distance: f64, outer: bool, volume: usize) -> Split {
        let middle = if outer { 0.75 } else { 0.25 } * self.radius;
        let delta = (distance - middle) / (self.radius / 2.0);
        let between = if outer { delta < 0.0 } else { delta > 0.0 };
        Split { share: delta.abs(), other: between.then_some(volume ^ 2) }
    }
}

/// How one neighbour is split between its own bin and the adjacent one.
#[derive(Clone, Copy)]
struct Split {
    /// Share of the adjacent bin, from 0 (in the middle of the own bin) to ½ (at the border).
    share: f64,
    /// The adjacent bin; beyond the outermost bin there is none, and the share is lost.
    other: Option<usize>,
}

/// Splits between the halves, whose middles are at 45° and 135° from z.
fn half_split(cosine: f64, upper: bool, volume: usize) -> Split {
    let middle = if upper { FRAC_PI_4 } else { 3.0 * FRAC_PI_4 };
    let delta = (cosine.clamp(-1.0, 1.0).acos() - middle) / FRAC_PI_2;
    let between = if upper { delta > 0.0 } else { delta < 0.0 };
    Split { share: delta.abs(), other: between.then_some(volume ^ 1) }
}

/// Splits between the sectors, which are cyclic, so that there is always an adjacent one.
fn sector_split(azimuth: f64, sector: usize, volume: usize) -> Split {
    let middle = -7.0 / 8.0 * PI + sector as f64 * FRAC_PI_4;
    let delta = ((azimuth - middle) / FRAC_PI_4).clamp(-0.5, 0.5);
    let step = if delta > 0.0 { 4 } else { VOLUMES - 4 };
    Split { share: delta.abs(), other: Some((volume + step) % VOLUMES) }
}

/// Divides by the Euclidean length; returns `false` if that is zero.
fn normalize_into(histogram: &[f64; DIM], row: &mut [f32]) -> bool {
    let norm = histogram.iter().map(|v| v * v).sum::<f64>().sqrt();
    row.iter_mut().zip(histogram).for_each(|(out, value)| *out = (value / norm) as f32);
    norm > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{ReferenceFrame, ShotFrame};
    use crate::testing::distance;
    use congruent_geometry::random::Stream;
    use congruent_simulation::testing::{bumpy, turned};

    const SHOT: Shot = Shot { radius: 4.0, pcl_wrap: false };

    fn deposited(shot: &Shot, local: Vector3<f64>, cosine: f64) -> [f64; DIM] {
        let mut histogram = [0.0; DIM];
        shot.deposit(&local, local.norm(), cosine, &mut histogram);
        histogram
    }

    fn polar(distance: f64, inclination: f64, azimuth: f64) -> Vector3<f64> {
        let (sin, cos) = inclination.sin_cos();
        Vector3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos) * distance
    }

    #[test]
    fn a_neighbor_in_the_middle_of_a_bin_fills_that_bin_only() {
        for volume in 0..VOLUMES {
            for bin in 0..COSINES {
                let distance = if volume & 2 == 2 { 3.0 } else { 1.0 };
                let inclination = if volume & 1 == 1 { FRAC_PI_4 } else { 3.0 * FRAC_PI_4 };
                let azimuth = -7.0 / 8.0 * PI + (volume / 4) as f64 * FRAC_PI_4;
                let histogram = deposited(&SHOT, polar(distance, inclination, azimuth), bin as f64 / 5.0 - 1.0);
                for (i, value) in histogram.iter().enumerate() {
                    let expected = if i == volume * COSINES + bin { 4.0 } else { 0.0 };
                    assert!((value - expected).abs() < 1e-9, "volume {volume} bin {bin}: {value} at {i}");
                }
            }
        }
    }

    #[test]
    fn an_interior_neighbor_weighs_four_and_any_other_three_to_four() {
        let mut stream = Stream::new(1, 0);
        for _ in 0..20_000 {
            let (distance, inclination) = (stream.between(1e-3, 4.0), stream.between(0.0, PI));
            let local = polar(distance, inclination, stream.between(-PI, PI));
            let histogram = deposited(&SHOT, local, stream.between(-1.0, 1.0));
            let mass: f64 = histogram.iter().sum();
            let interior = (1.0..3.0).contains(&distance) && (FRAC_PI_4..3.0 * FRAC_PI_4).contains(&inclination);
            assert!(if interior { (mass - 4.0).abs() < 1e-9 } else { mass > 3.0 - 1e-9 && mass < 4.0 + 1e-9 });
            assert!(histogram.iter().all(|v| *v >= 0.0));
        }
    }

    #[test]
    fn between_two_bins_both_get_a_share() {
        // Three tenths of the way from the middle of sector 4 to that of sector 5.
        let histogram = deposited(&SHOT, polar(1.0, FRAC_PI_4, FRAC_PI_4 * (0.5 + 0.3)), 0.0);
        assert!((histogram[(4 * 4 + 1) * COSINES + 5] - 3.7).abs() < 1e-9);
        assert!((histogram[(5 * 4 + 1) * COSINES + 5] - 0.3).abs() < 1e-9);
        // A quarter beyond the middle of the inner shell, in the direction of the outer.
        let histogram = deposited(&SHOT, polar(1.5, FRAC_PI_4, FRAC_PI_4 * 0.5), 0.0);
        assert!((histogram[(4 * 4 + 2 + 1) * COSINES + 5] - 0.25).abs() < 1e-9);
    }

    #[test]
    fn borders_and_the_axis_itself_are_in_range() {
        for local in [[-1.0, 0.0, 0.0], [-1.0, -0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -4.0], [2.0, 0.0, 0.0]] {
            for cosine in [-1.1, -1.0, 0.0, 1.0, 1.1] {
                let mass: f64 = deposited(&SHOT, local.into(), cosine).iter().sum();
                assert!((2.0..=4.0 + 1e-9).contains(&mass), "{local:?} {cosine}: {mass}");
            }
        }
    }

    #[test]
    fn the_topmost_cosine_spills_down_only_with_pcl_wrap() {
        let local = polar(1.0, FRAC_PI_4, FRAC_PI_4 * 0.5);
        let cosine = 9.3 / 5.0 - 1.0;
        let (plain, wrapped) =
            (deposited(&SHOT, local, cosine), deposited(&Shot { pcl_wrap: true, ..SHOT }, local, cosine));
        let first = (4 * 4 + 1) * COSINES;
        assert!((plain[first + 10] - 0.3).abs() < 1e-9 && plain[first] == 0.0);
        assert!((wrapped[first] - 0.3).abs() < 1e-9 && wrapped[first + 10] == 0.0);
    }

    #[test]
    fn a_turned_surface_is_described_alike() {
        let (before, shot) = (bumpy(40, 5), Shot { radius: 7.0, pcl_wrap: false });
        let settled: Vec<u32> = (0..before.len() as u32)
            .filter(|&i| ShotFrame { radius: 7.0 }.frame(&before, i).is_some_and(|f| f.margins.weakest() > 0.1))
            .collect();
        let (a, b) = (shot.describe(&before, &settled), shot.describe(&turned(&before, 6), &settled));
        assert!(settled.len() > 100 && a.keypoints == settled && b.keypoints == settled);
        let same = (0..a.len()).filter(|&i| distance(a.row(i), b.row(i)) < 1e-3).count();
        // A neighbour that rounding carries over a border moves its whole weight.
        assert!(same as f64 >= 0.98 * a.len() as f64, "{same} of {}", a.len());
    }

    #[test]
    fn rows_have_unit_length() {
        let surface = bumpy(30, 3);
        let features = Shot { radius: 5.0, pcl_wrap: false }.describe(&surface, &[3, 100, 450]);
        for i in 0..3 {
            assert!((features.row(i).iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5);
        }
    }
}
