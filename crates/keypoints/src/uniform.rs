//! Evenly spread keypoints: one point of the surface in each cell of a grid (as PCL's `UniformSampling`).

use crate::{Detector, Keypoint};
use congruent_geometry::{Length, Surface, most_central};
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
        let points = surface.points().par_iter().map(|point| point.map(f64::from));
        most_central(points, self.leaf).into_iter().map(|index| Keypoint { index, response: 0.0 }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::indices;
    use congruent_simulation::testing::{bumpy, surface};

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
