//! Dense metrics that sum a kernel's gain over all source points and their nearest target points.
//!
//! With the inlier count this is the number of overlapped points (#OP; Quan et al., GC1SAC, 2018), with `(1 − u)²` its
//! soft form. Each hypothesis costs one neighbour search per point: a thousand times the cost of correspondences, and
//! more.

use crate::clouds::CloudPair;
use crate::{Clouds, Density, Evidence, Kernel, Metric, Score};
use congruent_geometry::RigidTransform;

/// The sum of gains over the distances from the source points to the target. It depends only on the clouds, so
/// correspondences have no weight in it and there is nothing to fit.
pub struct NearestSum<'a, K> {
    kernel: K,
    clouds: CloudPair<'a>,
}

impl<'a, K: Kernel> NearestSum<'a, K> {
    /// Creates the metric. `resolution` is that of the pair, data units; beyond `reach` (data units) the kernel must be
    /// zero.
    #[must_use]
    pub fn new(kernel: K, clouds: Clouds<'a>, density: Density, resolution: f64, reach: f64) -> Self {
        NearestSum { kernel, clouds: CloudPair::new(clouds, density, resolution, reach) }
    }
}

impl<K: Kernel> Metric for NearestSum<'_, K> {
    fn score(&self, _: &Evidence, target_from_source: &RigidTransform) -> Score {
        let mut sum = 0.0;
        self.clouds.each_distance_sq(target_from_source, |d| sum += f64::from(self.kernel.gain(d)));
        Score::new(sum)
    }

    fn weight(&self, _: f64) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clouds::tests::{scatter, surface};
    use crate::{InlierCount, Mse};

    #[test]
    fn a_cloud_on_itself_overlaps_wholly_and_less_the_farther_it_is_moved() {
        let cloud = surface(scatter(500, 1));
        let clouds = Clouds { source: &cloud, target: &cloud };
        let count = NearestSum::new(InlierCount::new(5.0), clouds, Density::Full, 1.0, 5.0);
        let soft = NearestSum::new(Mse::new(5.0), clouds, Density::Full, 1.0, 5.0);
        let along = |metric: &dyn Metric, x: f64| {
            metric.score(&Evidence::default(), &RigidTransform::translation(x, 0.0, 0.0)).value()
        };
        assert_eq!((along(&count, 0.0), along(&soft, 0.0)), (500.0, 500.0));
        for metric in [&count as &dyn Metric, &soft] {
            // Within the cloud, a moved point soon has another neighbour: only the trend is monotone.
            let scores = [0.0, 10.0, 40.0, 80.0, 104.0, 106.0].map(|x| along(metric, x));
            assert!(scores.windows(2).all(|w| w[1] < w[0] || w[1] == 0.0), "{scores:?}");
            assert_eq!(scores[5], 0.0);
        }
        assert_eq!(count.weight(0.0), 0.0);
    }

    #[test]
    fn a_point_at_the_threshold_does_not_overlap() {
        let (source, target) = (surface(vec![[0.0; 3]]), surface(vec![[0.0; 3]]));
        let clouds = Clouds { source: &source, target: &target };
        let metric = NearestSum::new(InlierCount::new(2.0), clouds, Density::Full, 1.0, 2.0);
        for (x, expected) in [(0.0, 1.0), (1.999, 1.0), (2.0, 0.0), (9.0, 0.0)] {
            let pose = RigidTransform::translation(x, 0.0, 0.0);
            assert_eq!(metric.score(&Evidence::default(), &pose).value(), expected, "{x}");
        }
    }
}
