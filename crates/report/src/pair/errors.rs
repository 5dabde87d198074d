//! The error of each point of the source.

use super::PairReport;
use congruent_evaluation::{GroundTruth, SHARED_WITHIN_PR};
use congruent_geometry::{NeighborIndex, Point, RigidTransform, narrow, uncentred, wide};
use nalgebra::Point3;
use rayon::prelude::*;

/// Error at which the colours saturate, in `pr`: as in the paper's figure 11.
pub(super) const SATURATION_PR: f32 = 10.0;

impl PairReport<'_> {
    /// Returns the paper's RMSE; `None` without ground truth, pose, or shared surface.
    pub(super) fn rmse_pr(&self) -> Option<f64> {
        let (pose, truth) = (self.registration.pose()?, self.truth?);
        GroundTruth::of_scans(self.scans, truth).errors(pose).map(|errors| errors.rmse_pr)
    }

    /// Returns a number for each point of the source scan, in `pr`, NaN for points without a partner. With ground
    /// truth: the distance between the positions given by the estimate and by the truth, for points that the scans
    /// share. Without: the distance to the nearest target point, for points that have one within the saturation. Empty
    /// without a pose.
    pub(super) fn point_errors(&self) -> Vec<f32> {
        let Some(pose) = self.registration.pose() else { return Vec::new() };
        let pr = self.registration.raw_resolution;
        let pose = self.centred(pose);
        let target = NeighborIndex::new(self.scans.target.points());
        let distance =
            |p: &Point3<f64>| target.nearest(&narrow(&p.coords)).map(|hit| f64::from(hit.distance_sq).sqrt());
        let within = |p: &Point3<f64>, reach: f64| distance(p).filter(|d| *d <= reach * pr);
        let truth = self.truth.map(|truth| self.centred(truth));
        let error = |point: &Point| {
            let point = Point3::from(wide(*point));
            let error = match &truth {
                Some(truth) => {
                    within(&(truth * point), SHARED_WITHIN_PR).map(|_| (pose * point - truth * point).norm())
                }
                None => within(&(pose * point), f64::from(SATURATION_PR)),
            };
            error.map_or(f32::NAN, |error| (error / pr) as f32)
        };
        self.scans.source.points().par_iter().map(error).collect()
    }

    /// Returns a pose between the centred clouds.
    pub(super) fn centred(&self, pose: &RigidTransform) -> RigidTransform {
        uncentred(pose, &-self.scans.source.origin(), &-self.scans.target.origin())
    }
}
