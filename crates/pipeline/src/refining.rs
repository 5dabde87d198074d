//! Refinement of a rough pose from coarse to fine.

use crate::Pair;
use congruent_geometry::{RigidTransform, Surface};
use congruent_refinement::{Freedom, PointToPlane, Refiner, Schedule};

/// Search radius around a guess at first, in `pr`.
pub(crate) const GUESS_RADIUS: f64 = 15.0;
/// Search radius around any pose at the end, in `pr`.
const END_RADIUS: f64 = 2.5;

/// Refines a rough pose, with a search radius that shrinks from `radius` (data units); keeps it if the surfaces touch
/// less at the end.
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
