//! A rough pose, made exact from far to near.

use crate::Pair;
use congruent_geometry::{RigidTransform, Surface};
use congruent_refinement::{Freedom, PointToPlane, Refiner, Schedule};

/// How far a guess is looked around at first, in `pr`.
pub(crate) const GUESS_RADIUS: f64 = 15.0;
/// How far any pose is looked around at last, in `pr`.
const END_RADIUS: f64 = 2.5;

/// A rough pose, drawn in from as far as `radius` (data units); itself where the surfaces touch less at the end.
pub(crate) fn drawn_in(
    surfaces: &Pair<Surface>,
    rough: &RigidTransform,
    radius: f64,
    freedom: Freedom,
    resolution: f64,
) -> RigidTransform {
    let schedule = Schedule::rough([radius, END_RADIUS * resolution], resolution, freedom);
    PointToPlane { schedule }.refine(&surfaces.source, &surfaces.target, rough).target_from_source
}
