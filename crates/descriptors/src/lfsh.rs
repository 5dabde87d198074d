//! LFSH, local feature statistics histograms (Yang, Cao and Zhang 2016; details as in the authors' public code).
//!
//! Three short histograms of the points around a keypoint: depth below it, distance from the line of its normal, and
//! angle between the normals.

use crate::Descriptor;
use congruent_geometry::{Length, Surface, wide};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

const DEPTHS: usize = 10;
const DENSITIES: usize = 5;
const ANGLES: usize = 15;
const DIM: usize = DEPTHS + DENSITIES + ANGLES;
/// Minimum number of points, the keypoint included; the authors require more than five.
const MIN_POINTS: usize = 6;

/// `[descriptor.lfsh]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct LfshConfig {
    /// Radius of the neighbourhood; 15 pr in Yang et al.
    pub radius: Length,
    /// Whether the depth bins are shifted by half a bin, so that a flat patch falls into the middle of a bin instead of
    /// onto the border of two, where noise decides. Off in the authors' code.
    pub half_bin_shift: bool,
}

impl Default for LfshConfig {
    fn default() -> Self {
        LfshConfig { radius: Length::Resolutions(15.0), half_bin_shift: false }
    }
}

impl LfshConfig {
    /// Builds the descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Lfsh {
        Lfsh { radius: self.radius.resolve(resolution), half_bin_shift: self.half_bin_shift }
    }
}

/// 10 depths over [0, 2R], 5 distances over [0, R], 15 angles over [0, π]; each part sums to 1.
///
/// Needs the keypoint's normal and six points with normals, the keypoint and its duplicates included; the sign of the
/// normals matters.
#[derive(Clone, Debug, PartialEq)]
pub struct Lfsh {
    /// R, data units.
    pub radius: f64,
    /// Whether the depth bins are shifted by half a bin.
    pub half_bin_shift: bool,
}

impl Descriptor for Lfsh {
    fn dim(&self) -> usize {
        DIM
    }

    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool {
        let normal = wide(surface.normals()[keypoint as usize]);
        if normal == Vector3::zeros() {
            return false;
        }
        let centre = surface.points()[keypoint as usize];
        let (mut counts, mut n_points) = ([0u32; DIM], 0usize);
        surface.index().within(&centre, self.radius, |n| {
            let other = wide(surface.normals()[n.index as usize]);
            if other != Vector3::zeros() {
                let offset = wide(surface.points()[n.index as usize]) - wide(centre);
                n_points += 1;
                self.bins(&offset, &normal, &other).iter().for_each(|&bin| counts[bin] += 1);
            }
        });
        row.iter_mut().zip(counts).for_each(|(out, count)| *out = (f64::from(count) / n_points as f64) as f32);
        n_points >= MIN_POINTS
    }
}

impl Lfsh {
    /// Returns the bin of one point in each of the three parts.
    fn bins(&self, offset: &Vector3<f64>, normal: &Vector3<f64>, other: &Vector3<f64>) -> [usize; 3] {
        let height = offset.dot(normal);
        let depth = (self.radius + height) / (2.0 * self.radius);
        let shift = if self.half_bin_shift { 0.5 / DEPTHS as f64 } else { 0.0 };
        let density = (offset.norm_squared() - height * height).abs().sqrt() / self.radius;
        let angle = normal.dot(other).clamp(-1.0, 1.0).acos() / PI;
        [bin(depth + shift, DEPTHS), DEPTHS + bin(density, DENSITIES), DEPTHS + DENSITIES + bin(angle, ANGLES)]
    }
}

/// Returns the bin of a fraction of the range; values beyond the range go to the outermost bin.
fn bin(share: f64, count: usize) -> usize {
    ((share * count as f64).max(0.0) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{disc, distance};
    use congruent_simulation::testing::{bumpy, surface, turned};

    const LFSH: Lfsh = Lfsh { radius: 1.0, half_bin_shift: false };

    #[test]
    fn on_a_plane_the_parts_have_closed_forms() {
        let disc = disc(5000);
        for half_bin_shift in [false, true] {
            let features = Lfsh { half_bin_shift, ..LFSH }.describe(&disc, &[0]);
            let row = features.row(0);
            let spike = |part: &[f32], at: usize| part.iter().enumerate().all(|(i, v)| *v == f32::from(i == at));
            assert!(spike(&row[..10], 5) && spike(&row[15..], 0), "{row:?}");
            for (value, expected) in row[10..15].iter().zip([1.0, 3.0, 5.0, 7.0, 9.0]) {
                assert!((value * 25.0 - expected).abs() < 0.02, "{row:?}");
            }
        }
    }

    #[test]
    fn half_a_bin_of_noise_does_not_leave_the_shifted_bin() {
        let bins = |half_bin_shift, z| {
            Lfsh { half_bin_shift, ..LFSH }.bins(&Vector3::new(0.5, 0.0, z), &Vector3::z(), &Vector3::z())[0]
        };
        assert_eq!([bins(false, -0.05), bins(false, 0.05)], [4, 5]);
        assert_eq!([bins(true, -0.05), bins(true, 0.05)], [5, 5]);
    }

    #[test]
    fn the_ends_of_the_ranges_are_in_range() {
        let up = Vector3::z();
        assert_eq!(LFSH.bins(&up, &up, &-up), [9, 10, 29]);
        assert_eq!(LFSH.bins(&-up, &up, &(up * 1.1)), [0, 10, 15]);
        assert_eq!(LFSH.bins(&Vector3::x(), &up, &Vector3::x())[1..], [14, 22]);
    }

    #[test]
    fn each_part_sums_to_one() {
        let surface = bumpy(30, 4);
        let features = Lfsh { radius: 5.0, ..LFSH }.describe(&surface, &[0, 465, 899]);
        for i in 0..features.len() {
            let row = features.row(i);
            for part in [&row[..10], &row[10..15], &row[15..]] {
                assert!((part.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_turned_surface_is_described_alike() {
        let (before, lfsh) = (bumpy(30, 5), Lfsh { radius: 6.0, half_bin_shift: true });
        let all: Vec<u32> = (0..before.len() as u32).collect();
        let (a, b) = (lfsh.describe(&before, &all), lfsh.describe(&turned(&before, 6), &all));
        assert!(a.keypoints == all && b.keypoints == all);
        let same = (0..a.len()).filter(|&i| distance(a.row(i), b.row(i)) < 1e-4).count();
        // A point that rounding carries over a border moves its whole weight.
        assert!(same as f64 >= 0.97 * a.len() as f64, "{same} of {}", a.len());
    }

    #[test]
    fn six_points_are_needed() {
        let patch = |n: usize| {
            let offsets = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [-0.5, 0.0], [0.0, -0.5], [0.3, 0.3]];
            surface(offsets[..n].iter().map(|o| [o[0], o[1], 0.0]).collect())
        };
        assert_eq!(LFSH.describe(&patch(5), &[0]).len(), 0);
        assert_eq!(LFSH.describe(&patch(6), &[0]).len(), 1);
    }
}
