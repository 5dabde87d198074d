//! Errors of a pose against the true one.
//!
//! Errors are measured where the two scans share surface: on `C_gt`, the source points that have a target point within
//! four resolutions of their true position. The paper's formula for the point error contains only the true motion and
//! thus does not depend on the estimate; what is meant, and computed here, is the distance between the positions of a
//! point under the estimate and under the truth.

use congruent_geometry::{
    NeighborIndex, Point, RigidTransform, Scan, angle_between, mean_displacement, narrow, resolution, uncentred, wide,
};
use congruent_pipeline::Pair;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Source points with a target point within this distance of their true position, in resolutions, are shared.
pub const SHARED_WITHIN_PR: f64 = 4.0;
/// Pairs that share fewer points than this are not evaluable.
pub const MIN_SHARED: usize = 10;

/// The true pose of a pair of scans, and the points on which errors are measured.
#[derive(Clone, Debug)]
pub struct GroundTruth {
    /// True pose between the centred clouds.
    truth: RigidTransform,
    /// What was subtracted from the file coordinates of each cloud.
    origins: Pair<Vector3<f64>>,
    /// `C_gt`: centred source points.
    shared: Vec<Point>,
    resolution: f64,
    overlap: Pair<f64>,
}

/// The errors of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseErrors {
    /// The paper's RMSE: the mean (not root mean square) distance over `C_gt`, in `pr`.
    pub rmse_pr: f64,
    /// The root mean square distance over `C_gt`, in `pr`.
    pub rms_pr: f64,
    /// Angle between the rotations, degrees.
    pub rotation_deg: f64,
    /// Distance between the translations of the poses in file coordinates, data units. It depends on the origin of the
    /// coordinates.
    pub translation: f64,
}

impl GroundTruth {
    /// Creates the ground truth of two scans as provided; the truth is between file coordinates, and `pr` is the mean
    /// resolution of the scans.
    #[must_use]
    pub fn of_scans(scans: Pair<&Scan>, target_from_source: &RigidTransform) -> Self {
        let points = Pair { source: scans.source.points(), target: scans.target.points() };
        let origins = Pair { source: *scans.source.origin(), target: *scans.target.origin() };
        GroundTruth::of_points(points, origins, target_from_source)
    }

    /// Creates the ground truth of centred points, with what was subtracted from their file coordinates; the truth is
    /// between file coordinates, and `pr` is the mean resolution of the two clouds.
    ///
    /// # Panics
    /// If a cloud has fewer than two distinct points.
    #[must_use]
    pub fn of_points(points: Pair<&[Point]>, origins: Pair<Vector3<f64>>, target_from_source: &RigidTransform) -> Self {
        let truth = uncentred(target_from_source, &-origins.source, &-origins.target);
        let indices = points.par_map(NeighborIndex::new);
        let pr = points
            .zip(indices.as_ref())
            .map(|(points, index)| resolution(points, index).expect("two distinct points have a distance").mean);
        let resolution = f64::midpoint(pr.source, pr.target);
        let shared = shared(points.source, &indices.target, &truth, SHARED_WITHIN_PR * resolution);
        let back = self::shared(points.target, &indices.source, &truth.inverse(), SHARED_WITHIN_PR * resolution);
        let share = |n: usize, of: usize| n as f64 / of as f64;
        let overlap =
            Pair { source: share(shared.len(), points.source.len()), target: share(back.len(), points.target.len()) };
        GroundTruth { truth, origins, shared, resolution, overlap }
    }

    /// Returns the same truth between clouds centred at other origins, for instance the same scans with a nuisance.
    #[must_use]
    pub fn recentred(self, origins: Pair<Vector3<f64>>) -> Self {
        let in_file_coordinates = uncentred(&self.truth, &self.origins.source, &self.origins.target);
        let truth = uncentred(&in_file_coordinates, &-origins.source, &-origins.target);
        let moved = self.origins.source - origins.source;
        let shared = self.shared.iter().map(|p| narrow(&(wide(*p) + moved))).collect();
        GroundTruth { truth, origins, shared, ..self }
    }

    /// Returns the number of points in `C_gt`.
    #[must_use]
    pub fn n_shared(&self) -> usize {
        self.shared.len()
    }

    /// Returns whether enough surface is shared to measure errors: at least [`MIN_SHARED`] points.
    #[must_use]
    pub fn is_evaluable(&self) -> bool {
        self.shared.len() >= MIN_SHARED
    }

    /// Returns the fraction of the points that lie on shared surface: the smaller of both directions.
    #[must_use]
    pub fn overlap(&self) -> f64 {
        self.overlap.source.min(self.overlap.target)
    }

    /// Returns the mean resolution of the two clouds, data units: the meaning of `pr` in the errors.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Returns the true pose between the centred clouds.
    #[must_use]
    pub fn centred(&self) -> &RigidTransform {
        &self.truth
    }

    /// Returns the errors of a pose between file coordinates; `None` if the pair is not evaluable.
    #[must_use]
    pub fn errors(&self, target_from_source: &RigidTransform) -> Option<PoseErrors> {
        let Pair { source, target } = &self.origins;
        let in_file = |pose: &RigidTransform| uncentred(pose, source, target);
        let translation = target_from_source.translation.vector - in_file(&self.truth).translation.vector;
        let centred = uncentred(target_from_source, &-source, &-target);
        let rmse_pr = self.rmse_pr(&centred)?;
        let squares: f64 = self
            .shared
            .iter()
            .map(|&p| {
                let p = Point3::from(wide(p));
                (centred * p - self.truth * p).norm_squared()
            })
            .sum();
        Some(PoseErrors {
            rmse_pr,
            rms_pr: (squares / self.shared.len() as f64).sqrt() / self.resolution,
            rotation_deg: angle_between(&centred, &self.truth).to_degrees(),
            translation: translation.norm(),
        })
    }

    /// Returns the paper's RMSE of a pose between the centred clouds, in `pr`; `None` if the pair is not evaluable.
    #[must_use]
    pub fn rmse_pr(&self, centred: &RigidTransform) -> Option<f64> {
        self.is_evaluable().then(|| mean_displacement(&self.shared, centred, &self.truth) / self.resolution)
    }
}

/// Returns the points that, once moved, have a point of the other cloud within `radius` (inclusive).
fn shared(points: &[Point], other: &NeighborIndex, motion: &RigidTransform, radius: f64) -> Vec<Point> {
    let is_shared = |p: &&Point| {
        let moved = narrow(&(motion * Point3::from(wide(**p))).coords);
        other.nearest(&moved).is_some_and(|hit| f64::from(hit.distance_sq) <= radius * radius)
    };
    points.par_iter().filter(is_shared).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::RawScan;

    /// A grid of `nx` × `ny` points with spacing one and its corner at `(x, y)`.
    fn grid(nx: usize, ny: usize, x: f64, y: f64) -> Scan {
        let at = |i: usize, j: usize| [x + i as f64, y + j as f64, 1e6];
        let points = (0..nx).flat_map(|i| (0..ny).map(move |j| at(i, j))).collect();
        Scan::new(&RawScan { points, ..RawScan::default() }).unwrap()
    }

    fn shift(x: f64, y: f64, z: f64) -> RigidTransform {
        RigidTransform::translation(x, y, z)
    }

    #[test]
    fn shared_are_the_points_within_four_resolutions_of_the_truth() {
        // Columns 0..=9 against columns 100..=109 that begin seven later: 3 shared, and 4 more within the radius.
        let (source, target) = (grid(10, 4, 0.0, 0.0), grid(10, 4, 107.0, 0.0));
        let truth = GroundTruth::of_scans(Pair { source: &source, target: &target }, &shift(100.0, 0.0, 0.0));
        assert_eq!((truth.resolution(), truth.n_shared(), truth.overlap()), (1.0, 7 * 4, 0.7));
    }

    #[test]
    fn errors_are_in_resolutions_and_the_mean_is_not_the_root_mean_square() {
        let scan = grid(12, 2, 0.0, 0.0);
        let truth = GroundTruth::of_scans(Pair { source: &scan, target: &scan }, &shift(0.0, 0.0, 0.0));
        let moved = truth.errors(&shift(0.0, 3.0, 4.0)).unwrap();
        let expected = PoseErrors { rmse_pr: 5.0, rms_pr: 5.0, rotation_deg: 0.0, translation: 5.0 };
        assert!((moved.rmse_pr - 5.0).abs() < 1e-9 && (moved.rms_pr - 5.0).abs() < 1e-9, "{moved:?} {expected:?}");
        // Half a turn about the middle of a line of points 0.5, 1.5, … 5.5 to each side: they move by twice that.
        let line = Scan::new(&RawScan {
            points: (0..12).map(|i| [f64::from(i) - 5.5, 0.0, 0.0]).collect(),
            ..RawScan::default()
        })
        .unwrap();
        let truth = GroundTruth::of_scans(Pair { source: &line, target: &line }, &RigidTransform::identity());
        let turn = RigidTransform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, std::f64::consts::PI));
        let turned = truth.errors(&turn).unwrap();
        assert!((turned.rmse_pr - 6.0).abs() < 1e-6, "{turned:?}");
        // The mean of 1, 9, 25, 49, 81, 121 is 286 / 6.
        assert!((turned.rms_pr - (286.0f64 / 6.0).sqrt()).abs() < 1e-6, "{turned:?}");
        assert!((turned.rotation_deg - 180.0).abs() < 1e-6 && turned.translation < 1e-9, "{turned:?}");
    }

    #[test]
    fn the_unit_does_not_matter_and_the_truth_itself_has_no_error() {
        let (source, target) = (grid(9, 9, 0.0, 0.0), grid(9, 9, 500.0, -3.0));
        let motion = shift(500.0, -3.0, 0.0);
        let truth = GroundTruth::of_scans(Pair { source: &source, target: &target }, &motion);
        assert!(truth.errors(&motion).unwrap().rmse_pr < 1e-9);
        let scaled = |scan: &Scan| {
            let points = scan.points().iter().map(|p| (0.001 * (wide(*p) + scan.origin())).into()).collect();
            Scan::new(&RawScan { points, ..RawScan::default() }).unwrap()
        };
        let (source, target) = (scaled(&source), scaled(&target));
        let truth = GroundTruth::of_scans(Pair { source: &source, target: &target }, &shift(0.5, -0.003, 0.0));
        let error = truth.errors(&shift(0.502, -0.003, 0.0)).unwrap();
        assert!((error.rmse_pr - 2.0).abs() < 1e-3, "{error:?}");
    }

    #[test]
    fn another_centre_changes_no_error() {
        let (source, target) = (grid(9, 9, 0.0, 0.0), grid(9, 9, 500.0, -3.0));
        let motion = shift(500.0, -3.0, 0.0);
        let truth = GroundTruth::of_scans(Pair { source: &source, target: &target }, &motion);
        let off = shift(501.0, -3.0, 0.5);
        let error = truth.errors(&off).unwrap().rmse_pr;
        let origins = Pair { source: Vector3::new(7.0, 1.0, -2.0), target: Vector3::new(400.0, 0.0, 3.0) };
        let recentred = truth.recentred(origins);
        assert!((recentred.errors(&off).unwrap().rmse_pr - error).abs() < 1e-4);
        let centred = congruent_geometry::uncentred(&off, &-origins.source, &-origins.target);
        assert!((recentred.rmse_pr(&centred).unwrap() - error).abs() < 1e-4);
    }

    #[test]
    fn too_little_shared_surface_is_not_judged() {
        let (source, target) = (grid(9, 1, 0.0, 0.0), grid(9, 1, 0.0, 0.0));
        let truth = GroundTruth::of_scans(Pair { source: &source, target: &target }, &RigidTransform::identity());
        assert!(!truth.is_evaluable() && truth.errors(&RigidTransform::identity()).is_none());
    }
}
