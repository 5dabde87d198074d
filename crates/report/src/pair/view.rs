//! The 3D view of one registration.

use super::PairReport;
use super::errors::SATURATION_PR;
use crate::palette::{INLIER, OUTLIER};
use crate::picture::before_and_after;
use crate::{Errors, Layer, Lines, Points, SOURCE, Scene, State, TARGET};
use congruent_geometry::{RigidTransform, Scan, Surface, wide};
use congruent_pipeline::Pair;
use nalgebra::{Point3, Translation3, Vector3};

/// Numbers of the bodies of the scene.
const SOURCE_BODY: usize = 0;
const TARGET_BODY: usize = 1;

impl PairReport<'_> {
    pub(super) fn scene(&self) -> Scene {
        let scans = self.scans.map(file_points);
        let coordinates =
            scans.as_ref().map(|points| points.iter().map(|p| p.coords.into()).collect::<Vec<[f64; 3]>>());
        let pose = self.registration.pose();
        let fallback = before_and_after(coordinates.as_ref().map(Vec::as_slice), pose);
        let cloud = |name: &str, body, points, colour: &str, errors| {
            Layer::Points(Points { name: name.to_owned(), body, points, colour: colour.to_owned(), errors })
        };
        let mut layers = vec![
            cloud("source", SOURCE_BODY, scans.source, SOURCE, self.point_errors()),
            cloud("target", TARGET_BODY, scans.target, TARGET, Vec::new()),
        ];
        layers.extend(self.correspondences());
        Scene {
            states: self.states(),
            layers,
            errors: pose.map(|_| self.legend()),
            viewpoint: self.registration.estimate().and_then(|found| found.views.target.viewpoint).map(Point3::from),
            unit: String::new(),
            fallback,
        }
    }

    fn legend(&self) -> Errors {
        let (name, grey) = match self.truth {
            Some(_) => ("distance from the true position", "not in the other scan"),
            None => ("distance to the target", "none within 10 pr"),
        };
        Errors { name: name.to_owned(), unit: "pr".to_owned(), saturation: SATURATION_PR, grey: grey.to_owned() }
    }

    /// Returns the scans as scanned, with the source as placed by the true pose and by other poses, and last by the
    /// result.
    fn states(&self) -> Vec<State> {
        let state = |name: String, pose| State { name, frame_from_body: vec![pose] };
        let mut states = vec![state("as scanned".to_owned(), self.beside())];
        let Some(pose) = self.registration.pose() else { return states };
        states.extend(self.truth.map(|truth| state("true pose".to_owned(), *truth)));
        for (i, other) in (1..).zip(self.registration.alternatives()) {
            states.push(state(format!("other pose {i}"), other.target_from_source));
        }
        states.push(state("aligned".to_owned(), *pose));
        states
    }

    /// Returns the initial pose of the source: as in its file, or about the target's middle if the two frames are
    /// unrelated.
    fn beside(&self) -> RigidTransform {
        let Pair { source, target } = self.scans;
        let apart = target.origin() - source.origin();
        let reach = 0.5 * (source.extent().norm() + target.extent().norm());
        let shift = if apart.norm() < reach { Vector3::zeros() } else { apart };
        RigidTransform::from_parts(Translation3::from(shift), nalgebra::UnitQuaternion::identity())
    }

    /// Returns the correspondences that agree with the result, and the others; all together if there is no result.
    fn correspondences(&self) -> Vec<Layer> {
        let Some(surfaces) = &self.trace.surfaces else { return Vec::new() };
        let threshold = self.config.verdict.inlier_threshold().resolve(self.registration.resolution);
        let pose = self.registration.pose().map(|pose| self.centred(pose));
        let (mut agreeing, mut others) = (Vec::new(), Vec::new());
        for matched in &self.trace.matches {
            let (p, q) = (point(&surfaces.source, matched.source), point(&surfaces.target, matched.target));
            let agrees = pose.is_some_and(|pose| (pose * Point3::from(p) - Point3::from(q)).norm() < threshold);
            let ends = [p + self.scans.source.origin(), q + self.scans.target.origin()].map(Point3::from);
            if agrees { agreeing.push(ends) } else { others.push(ends) }
        }
        let lines = |name: &str, segments, colour: &str| {
            let (name, colour) = (name.to_owned(), colour.to_owned());
            Layer::Lines(Lines { name, bodies: [SOURCE_BODY, TARGET_BODY], segments, colour, shown: false })
        };
        let rest = if pose.is_some() { "other correspondences" } else { "correspondences" };
        match pose {
            Some(_) => vec![lines("inliers", agreeing, INLIER), lines(rest, others, OUTLIER)],
            None => vec![lines(rest, others, OUTLIER)],
        }
    }
}

fn point(surface: &Surface, index: u32) -> Vector3<f64> {
    wide(surface.points()[index as usize])
}

/// Returns the points in the coordinates of the file.
fn file_points(scan: &Scan) -> Vec<Point3<f64>> {
    scan.points().iter().map(|p| Point3::from(wide(*p) + scan.origin())).collect()
}
