//! What is measured of a pose before it is judged.

use crate::Pair;
use crate::verdict::{Evident, POWERS_OF_PLANES, Significance, Standing};
use congruent_geometry::{MOSTLY_FLAT, Point, RigidTransform, Surface, flatness, narrow, wide};
use congruent_metrics::Evidence;
use congruent_refinement::PointToPlane;

/// Distance up to which points touch when the flatness of the touching surface is measured, `pr`.
const TOUCHING_PR: f64 = 3.0;
/// Number of points of the source that are examined for it.
const ASKED: usize = 600;

/// What the poses of an attempt are measured with.
pub(crate) struct Gauge<'a> {
    pub(crate) surfaces: &'a Pair<Surface>,
    pub(crate) evidence: &'a Evidence,
    /// Measures how firmly the surfaces hold a pose where they touch.
    pub(crate) contact: PointToPlane,
    /// Residual below which correspondences are inliers, data units.
    pub(crate) inlier_threshold: f64,
    /// Number of trials among which the poses were the best.
    pub(crate) trials: u64,
    /// Whether only poses near a guess were considered: there are few in which planes could fit by chance.
    pub(crate) is_near: bool,
    /// `pr`, data units.
    pub(crate) resolution: f64,
}

impl Gauge<'_> {
    /// Measures a pose: whether its inliers exceed chance, how firmly the surfaces hold it, and the flatness of the
    /// touching surface.
    pub(crate) fn evident(&self, pose: &RigidTransform, standing: Standing) -> Evident {
        let Pair { source, target } = self.surfaces;
        let hold = self.contact.measure(source, target, pose).hold;
        let significance = Significance::of(pose, self.evidence, self.inlier_threshold, self.trials);
        let is_strong = -significance.log10_false_alarms >= POWERS_OF_PLANES;
        let reach = TOUCHING_PR * self.resolution;
        let flatness = if is_strong || self.is_near { 0.0 } else { touching_flatness(self.surfaces, pose, reach) };
        Evident { standing, significance, hold, flatness, resolution: self.resolution }
    }
}

/// Returns the fraction of the source, or of the part of it that touches the target within `reach` (data units), that
/// faces the same three directions: the smaller of the two, because a small patch of any surface faces few directions.
fn touching_flatness(surfaces: &Pair<Surface>, target_from_source: &RigidTransform, reach: f64) -> f64 {
    let Pair { source, target } = surfaces;
    let asked = || (0..source.len()).step_by(source.len().div_ceil(ASKED).max(1));
    let normals =
        |places: &mut dyn Iterator<Item = usize>| -> Vec<Point> { places.map(|at| source.normals()[at]).collect() };
    let whole = flatness(&normals(&mut asked()));
    if whole < MOSTLY_FLAT {
        return whole;
    }
    let touches = |at: &usize| {
        let moved = target_from_source * nalgebra::Point3::from(wide(source.points()[*at]));
        target.index().nearest_within(&narrow(&moved.coords), reach).is_some()
    };
    whole.min(flatness(&normals(&mut asked().filter(touches))))
}
