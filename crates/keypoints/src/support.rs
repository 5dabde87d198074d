//! The support of keypoints: they need surface around them, which stray points do not have.

use crate::Keypoint;
use congruent_geometry::{Length, RadiusSearch, Surface};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Returns the keypoints with at least `min_points` surface points (itself included) within `radius` (data units), in
/// their order.
#[must_use]
pub fn supported(surface: &Surface, keypoints: &[Keypoint], radius: f64, min_points: usize) -> Vec<Keypoint> {
    let around = RadiusSearch::new(surface, radius);
    let has_support = |k: &&Keypoint| around.has(&surface.points()[k.index as usize], min_points);
    keypoints.par_iter().filter(has_support).copied().collect()
}

/// How much surface a keypoint needs around it to be worth describing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SupportFilter {
    /// Radius of the support; 15 pr, the descriptors' own radius, in the demo code of Yang et al.
    pub radius: Length,
    /// Minimum number of surface points within the radius, the keypoint included; 10 in the demo code of Yang et al.
    pub min_points: usize,
}

impl Default for SupportFilter {
    fn default() -> Self {
        SupportFilter { radius: Length::Resolutions(15.0), min_points: 10 }
    }
}

impl SupportFilter {
    /// Returns the [`supported`] keypoints, for a cloud of this resolution.
    #[must_use]
    pub fn apply(&self, surface: &Surface, keypoints: &[Keypoint], resolution: f64) -> Vec<Keypoint> {
        supported(surface, keypoints, self.radius.resolve(resolution), self.min_points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::indices;
    use congruent_simulation::testing::surface;

    #[test]
    fn keypoints_with_too_few_points_around_them_are_dropped() {
        let mut points: Vec<_> = (0..10u8).map(|i| [f32::from(i), 0.0, 0.0]).collect();
        points.extend((0..9u8).map(|i| [100.0 + f32::from(i), 0.0, 0.0]));
        let surface = surface(points);
        let keypoints = [18, 3, 0].map(|index| Keypoint { index, response: 1.0 });
        assert_eq!(indices(&SupportFilter::default().apply(&surface, &keypoints, 1.0)), [3, 0]);
        assert_eq!(indices(&supported(&surface, &keypoints, 1.0, 3)), [3]);
        assert_eq!(supported(&surface, &keypoints, 0.5, 1), keypoints);
    }
}
