//! Evenly spread keypoints: one point of the surface in each cell of a grid (as PCL's `UniformSampling`).

use crate::{Detector, Keypoint};
use congruent_geometry::{Length, Point, Surface};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// `[detector.uniform]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct UniformConfig {
    /// Side of a cell; the default is our own.
    pub leaf: Length,
}

impl Default for UniformConfig {
    fn default() -> Self {
        UniformConfig { leaf: Length::Resolutions(4.0) }
    }
}

impl UniformConfig {
    /// Builds the detector for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Uniform {
        Uniform { leaf: self.leaf.resolve(resolution) }
    }
}

/// Picks the point nearest to the centre of each occupied cell `floor(x / leaf)`; ties go to the lower index.
///
/// All responses are 0. The grid is aligned with the coordinate axes, so a rotated surface has other keypoints.
#[derive(Clone, Debug, PartialEq)]
pub struct Uniform {
    /// Side of a cell, data units.
    pub leaf: f64,
}

impl Detector for Uniform {
    fn detect(&self, surface: &Surface) -> Vec<Keypoint> {
        let mut members: Vec<([i64; 3], f64, u32)> = surface
            .points()
            .par_iter()
            .zip(0..surface.len() as u32)
            .map(|(point, index)| {
                let (cell, distance_sq) = self.place(point);
                (cell, distance_sq, index)
            })
            .collect();
        members.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        members.dedup_by_key(|member| member.0);
        members.par_sort_unstable_by_key(|member| member.2);
        members.iter().map(|&(_, _, index)| Keypoint { index, response: 0.0 }).collect()
    }
}

impl Uniform {
    /// Returns the cell of a point and the squared distance from its centre, in cells.
    fn place(&self, point: &Point) -> ([i64; 3], f64) {
        let at = point.map(|v| f64::from(v) / self.leaf);
        let distance_sq = at.iter().map(|v| (v - v.floor() - 0.5).powi(2)).sum();
        (at.map(|v| v.floor() as i64), distance_sq)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::indices;
    use congruent_simulation::testing::{bumpy, surface};
    use std::collections::BTreeSet;

    #[test]
    fn each_occupied_cell_gives_the_point_nearest_to_its_centre() {
        let surface = bumpy(30, 4);
        let uniform = Uniform { leaf: 3.0 };
        let keypoints = indices(&uniform.detect(&surface));
        assert!(keypoints.is_sorted());
        let cells: BTreeSet<_> = surface.points().iter().map(|p| uniform.place(p).0).collect();
        assert_eq!(keypoints.len(), cells.len());
        for k in keypoints {
            let (cell, distance_sq) = uniform.place(&surface.points()[k as usize]);
            let mut others = surface.points().iter().map(|p| uniform.place(p)).filter(|other| other.0 == cell);
            assert!(others.all(|other| other.1 >= distance_sq));
        }
    }

    #[test]
    fn sampling_the_sample_changes_nothing() {
        let first = bumpy(30, 6);
        let uniform = Uniform { leaf: 2.5 };
        let kept = indices(&uniform.detect(&first));
        let second = surface(kept.iter().map(|&i| first.points()[i as usize]).collect());
        assert_eq!(uniform.detect(&second).len(), kept.len());
    }

    #[test]
    fn ties_go_to_the_lower_index() {
        let pair = surface(vec![[0.7, 0.5, 0.5], [0.3, 0.5, 0.5], [0.3, 0.5, 0.5], [-9.0, 0.0, 0.0]]);
        // 0.3 and 0.7 are not equally far from 0.5 in `f32`; the exact duplicates are.
        assert_eq!(indices(&Uniform { leaf: 1.0 }.detect(&pair)).len(), 2);
        let mirror = surface(vec![[0.75, 0.5, 0.5], [0.25, 0.5, 0.5], [-9.0, 0.0, 0.0]]);
        assert_eq!(indices(&Uniform { leaf: 1.0 }.detect(&mirror)), [0, 2]);
    }
}
