//! Mean distance of the source points to the target (PC Dist; Yang et al., OSAC, 2016).

use crate::clouds::CloudPair;
use crate::{Clouds, Density, Evidence, Metric, Score};
use congruent_geometry::RigidTransform;
use serde::{Deserialize, Serialize};

/// A pose with at most this fraction of points near the target is rejected; value from the authors' program.
const MIN_NEAR_SHARE: f64 = 0.3;

/// Two readings of the metric.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reading {
    /// As in the authors' program: only points near the target count, and there must be enough of them.
    #[default]
    Original,
    /// As in the paper's text: all points count, however far.
    Literal,
}

/// The mean distance, negated, because larger scores are better. It depends only on the clouds, so correspondences have
/// no weight in it and there is nothing to fit.
pub struct PointDistance<'a> {
    clouds: CloudPair<'a>,
    /// Points at this squared distance or beyond are not near; infinite for the literal reading.
    max_distance_sq: f32,
}

impl<'a> PointDistance<'a> {
    /// Creates the metric; `threshold` and `resolution` (that of the pair) in data units.
    #[must_use]
    pub fn new(threshold: f64, reading: Reading, clouds: Clouds<'a>, density: Density, resolution: f64) -> Self {
        let reach = match reading {
            Reading::Original => threshold,
            Reading::Literal => f64::INFINITY,
        };
        let clouds = CloudPair::new(clouds, density, resolution, reach);
        PointDistance { clouds, max_distance_sq: (reach * reach) as f32 }
    }
}

impl Metric for PointDistance<'_> {
    fn score(&self, _: &Evidence, target_from_source: &RigidTransform) -> Score {
        let (mut count, mut sum) = (0usize, 0.0);
        self.clouds.each_distance_sq(target_from_source, |d| {
            if d < self.max_distance_sq {
                count += 1;
                sum += f64::from(d).sqrt();
            }
        });
        let enough = count as f64 > MIN_NEAR_SHARE * self.clouds.len() as f64;
        if enough { Score::new(-sum / count as f64) } else { Score::WORST }
    }

    fn weight(&self, _: f64) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clouds::tests::{scatter, surface};
    use congruent_geometry::Surface;

    fn score(source: &Surface, target: &Surface, reading: Reading, x: f64) -> Score {
        let clouds = Clouds { source, target };
        let metric = PointDistance::new(5.0, reading, clouds, Density::Full, 1.0);
        metric.score(&Evidence::default(), &RigidTransform::translation(x, 0.0, 0.0))
    }

    #[test]
    fn a_cloud_lies_on_itself() {
        let cloud = surface(scatter(300, 1));
        for reading in [Reading::Original, Reading::Literal] {
            assert_eq!(score(&cloud, &cloud, reading, 0.0).value(), 0.0);
            assert!(score(&cloud, &cloud, reading, 1.0) < score(&cloud, &cloud, reading, 0.1));
        }
    }

    #[test]
    fn far_points_are_left_out_or_counted_as_the_reading_says() {
        // Points at 1, 1 and 100 from the target.
        let source = surface(vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 100.0, 0.0]]);
        let target = surface(vec![[0.0; 3]]);
        assert_eq!(score(&source, &target, Reading::Original, 0.0).value(), -1.0);
        assert_eq!(score(&source, &target, Reading::Literal, 0.0).value(), -34.0);
    }

    #[test]
    fn three_near_points_in_ten_are_too_few() {
        let near = |n: usize| surface((0..10).map(|i| [if i < n { 1.0 } else { 900.0 }, 0.0, 0.0]).collect());
        let target = surface(vec![[0.0; 3]]);
        assert_eq!(score(&near(3), &target, Reading::Original, 0.0), Score::WORST);
        assert_eq!(score(&near(4), &target, Reading::Original, 0.0).value(), -1.0);
        assert_eq!(score(&near(4), &target, Reading::Original, 4.0), Score::WORST);
        assert!(score(&near(3), &target, Reading::Literal, 0.0) > Score::WORST);
    }

    #[test]
    fn empty_clouds_have_no_pose() {
        let (cloud, none) = (surface(scatter(9, 1)), surface(vec![]));
        for reading in [Reading::Original, Reading::Literal] {
            assert_eq!(score(&none, &cloud, reading, 0.0), Score::WORST);
            assert_eq!(score(&cloud, &none, reading, 0.0), Score::WORST);
        }
    }
}
