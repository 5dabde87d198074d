//! FPFH, fast point feature histograms (Rusu, Blodow and Beetz 2009; details as in PCL and Open3D).
//!
//! Describes how a keypoint's neighbours lie relative to *their* neighbours, pair by pair; nearer neighbours weigh
//! more.

use crate::descriptor::table;
use crate::pair::{BINS, DIM, PairHistograms};
use crate::{Descriptor, Features};
use congruent_geometry::{Length, Surface};
use serde::{Deserialize, Serialize};

/// Which histograms are summed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FpfhVariant {
    /// Only those of the neighbours; each block sums to 100.
    Pcl,
    /// Those of the neighbours and the keypoint's own; each block sums to 200.
    #[default]
    Open3d,
}

/// `[descriptor.fpfh]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct FpfhConfig {
    /// Radius of the neighbourhood, and of the neighbours' own; 15 pr as for the descriptors of Yang et al.
    pub radius: Length,
    /// Which histograms are summed.
    pub variant: FpfhVariant,
}

impl Default for FpfhConfig {
    fn default() -> Self {
        FpfhConfig { radius: Length::Resolutions(15.0), variant: FpfhVariant::Open3d }
    }
}

impl FpfhConfig {
    /// Builds the descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Fpfh {
        Fpfh { radius: self.radius.resolve(resolution), variant: self.variant }
    }
}

/// 33 numbers: 11 bins each of the angle f1 and the cosines f2 and f3 of pairs of normals.
///
/// Needs the keypoint's normal and one neighbour with a normal. The neighbours' histograms are weighted by 1/d², as in
/// PCL; the paper writes 1/d. Reversing all normals mirrors the first and last block.
///
/// Describing many points at once shares the histograms of common neighbours and is far cheaper than one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct Fpfh {
    /// Radius of the neighbourhood and of the neighbours' own, data units.
    pub radius: f64,
    /// Which histograms are summed.
    pub variant: FpfhVariant,
}

impl Descriptor for Fpfh {
    fn dim(&self) -> usize {
        DIM
    }

    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool {
        self.combine(surface, keypoint, &self.histograms(surface, &[keypoint]), row)
    }

    fn describe(&self, surface: &Surface, keypoints: &[u32]) -> Features {
        let histograms = self.histograms(surface, keypoints);
        table(DIM, keypoints, |keypoint, row| self.combine(surface, keypoint, &histograms, row))
    }
}

/// If more than one in this many points is a keypoint, nearly every point is somebody's neighbour, and finding out
/// which are not costs more than it saves.
const DENSE_SHARE: usize = 8;

impl Fpfh {
    /// Marks the keypoints and their neighbours.
    fn needed(&self, surface: &Surface, keypoints: &[u32]) -> Vec<bool> {
        if keypoints.len() * DENSE_SHARE > surface.len() {
            return vec![true; surface.len()];
        }
        let mut is_needed = vec![false; surface.len()];
        for &keypoint in keypoints {
            is_needed[keypoint as usize] = true;
            let centre = &surface.points()[keypoint as usize];
            surface.index().within(centre, self.radius, |n| is_needed[n.index as usize] = true);
        }
        is_needed
    }

    /// Computes all histograms that these keypoints need.
    fn histograms(&self, surface: &Surface, keypoints: &[u32]) -> PairHistograms {
        PairHistograms::new(surface, &self.needed(surface, keypoints), self.radius)
    }

    /// Sums the neighbours' histograms, scales each block to 100, and adds the keypoint's own where the variant does.
    fn combine(&self, surface: &Surface, keypoint: u32, histograms: &PairHistograms, row: &mut [f32]) -> bool {
        let sum = histograms.weighted(&surface.points()[keypoint as usize]);
        let own = match self.variant {
            FpfhVariant::Pcl => [0.0; DIM],
            FpfhVariant::Open3d => *histograms.of(keypoint),
        };
        for block in 0..3 {
            let total: f64 = sum[block * BINS..][..BINS].iter().sum();
            for i in block * BINS..(block + 1) * BINS {
                row[i] = (100.0 * sum[i] / total) as f32 + own[i];
            }
        }
        surface.normals()[keypoint as usize] != [0.0; 3] && row.iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{distance, flipped};
    use congruent_simulation::testing::{bumpy, turned};

    fn fpfh(variant: FpfhVariant) -> Fpfh {
        Fpfh { radius: 4.0, variant }
    }

    #[test]
    fn blocks_sum_to_one_or_two_hundred() {
        let surface = bumpy(25, 1);
        for (variant, expected) in [(FpfhVariant::Pcl, 100.0), (FpfhVariant::Open3d, 200.0)] {
            let features = fpfh(variant).describe(&surface, &[0, 60, 312]);
            assert_eq!(features.len(), 3);
            for block in features.rows.chunks_exact(BINS) {
                assert!((block.iter().sum::<f32>() - expected).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn one_by_one_and_all_at_once_agree() {
        let surface = bumpy(25, 2);
        for variant in [FpfhVariant::Pcl, FpfhVariant::Open3d] {
            let keypoints = [312, 5, 77];
            let features = fpfh(variant).describe(&surface, &keypoints);
            for (i, &keypoint) in keypoints.iter().enumerate() {
                let mut row = [0.0; DIM];
                assert!(fpfh(variant).describe_into(&surface, keypoint, &mut row));
                assert_eq!(features.row(i), row);
            }
        }
    }

    #[test]
    fn turning_all_normals_round_mirrors_the_first_and_last_block() {
        let surface = bumpy(25, 3);
        let all: Vec<u32> = (0..surface.len() as u32).collect();
        let pcl = fpfh(FpfhVariant::Pcl);
        let (up, down) = (pcl.describe(&surface, &all), pcl.describe(&flipped(&surface), &all));
        for i in 0..up.len() {
            let (a, b) = (up.row(i), down.row(i));
            for bin in 0..BINS {
                let mirrored = BINS - 1 - bin;
                assert!((a[bin] - b[mirrored]).abs() < 1e-3);
                assert!((a[BINS + bin] - b[BINS + bin]).abs() < 1e-3);
                assert!((a[2 * BINS + bin] - b[2 * BINS + mirrored]).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn a_turned_surface_is_described_alike() {
        let pcl = fpfh(FpfhVariant::Pcl);
        let (mut same, mut all) = (0, 0);
        for seed in 4..9 {
            let before = bumpy(25, seed);
            let points: Vec<u32> = (0..before.len() as u32).collect();
            let (a, b) = (pcl.describe(&before, &points), pcl.describe(&turned(&before, seed + 1), &points));
            // A pair that rounding carries over a border moves a few hundredths of a percent.
            same += (0..a.len()).filter(|&i| distance(a.row(i), b.row(i)) < 0.5).count();
            all += a.len();
        }
        assert!(same as f64 >= 0.99 * all as f64, "{same} of {all}");
    }
}
