//! How many matches and keypoints are right.

use congruent_geometry::{NeighborIndex, Point, RigidTransform, narrow, wide};
use congruent_metrics::Evidence;
use nalgebra::Point3;

/// The number of true correspondences among all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InlierShare {
    /// Number of correspondences that are inliers of the true pose.
    pub inliers: usize,
    /// Number of all correspondences.
    pub matches: usize,
}

impl InlierShare {
    /// Returns the inlier ratio; zero for no matches.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.inliers as f64 / self.matches.max(1) as f64
    }
}

/// Counts the correspondences with a residual of at most `threshold` (data units) under the truth.
#[must_use]
pub fn inlier_share(evidence: &Evidence, truth: &RigidTransform, threshold: f64) -> InlierShare {
    let inliers = (0..evidence.len()).filter(|&i| evidence.residual(i, truth) <= threshold).count();
    InlierShare { inliers, matches: evidence.len() }
}

/// Returns the fraction of the source keypoints on shared surface that have a target keypoint within `radius` of their
/// true position. A source keypoint is on shared surface if a target point lies within `shared_radius` of that
/// position; both radii are inclusive, data units. `None` if no source keypoint is on shared surface.
#[must_use]
pub fn repeatability(
    source_keypoints: &[Point],
    target_keypoints: &[Point],
    target: &NeighborIndex,
    truth: &RigidTransform,
    radius: f64,
    shared_radius: f64,
) -> Option<f64> {
    let keypoints = NeighborIndex::new(target_keypoints);
    let near = |index: &NeighborIndex, p: &Point, radius: f64| {
        index.nearest(p).is_some_and(|hit| f64::from(hit.distance_sq) <= radius * radius)
    };
    let images = source_keypoints.iter().map(|&p| narrow(&(truth * Point3::from(wide(p))).coords));
    let shared: Vec<Point> = images.filter(|p| near(target, p, shared_radius)).collect();
    let repeated = shared.iter().filter(|p| near(&keypoints, p, radius)).count();
    (!shared.is_empty()).then(|| repeated as f64 / shared.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inliers_are_counted_up_to_and_with_the_threshold() {
        let truth = RigidTransform::translation(10.0, 0.0, 0.0);
        let off = [0.0f32, 4.0, 5.0, 5.5, 7.5, 90.0];
        let evidence = Evidence::new(off.map(|y| ([1.0, 2.0, 3.0], [11.0, 2.0 + y, 3.0])));
        let at = |threshold| inlier_share(&evidence, &truth, threshold);
        assert_eq!((at(5.0).inliers, at(7.5).inliers, at(5.0).matches), (3, 5, 6));
        assert_eq!(at(5.0).ratio(), 0.5);
        assert_eq!(inlier_share(&Evidence::default(), &truth, 5.0).ratio(), 0.0);
    }

    #[test]
    fn repeated_keypoints_are_counted_on_shared_surface_alone() {
        let truth = RigidTransform::translation(0.0, 100.0, 0.0);
        let surface: Vec<Point> = (0..20).map(|i| [i as f32, 100.0, 0.0]).collect();
        let index = NeighborIndex::new(&surface);
        // At 0: repeated. At 5: 2.5 away. At 10: exactly 2 away. At 90: on a surface that the target does not have.
        let source: [Point; 4] = [[0.0; 3], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0], [90.0, 0.0, 0.0]];
        let target: [Point; 3] = [[0.0, 100.0, 0.0], [7.5, 100.0, 0.0], [12.0, 100.0, 0.0]];
        let share = |source: &[Point], target: &[Point]| repeatability(source, target, &index, &truth, 2.0, 4.0);
        assert_eq!(share(&source, &target), Some(2.0 / 3.0));
        assert_eq!(share(&source[3..], &target), None);
        assert_eq!(share(&source, &[]), Some(0.0));
    }
}
