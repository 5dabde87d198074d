//! A rough guess, made good enough for the others to compete with.

use crate::Pair;
use congruent_geometry::{RigidTransform, Surface};
use congruent_refinement::{Freedom, PointToPlane, Refiner, Schedule};

/// How far a guess is looked around at first and at last, in `pr`.
const GUESS_RADII: [f64; 2] = [15.0, 2.5];
const GUESS_ROUNDS: usize = 30;
/// Points of the source that this uses in a round.
const GUESS_POINTS: usize = 4000;

/// A rough guess, drawn in from far; itself where the surfaces touch less at the end.
pub(crate) fn drawn_in(
    surfaces: &Pair<Surface>,
    guess: &RigidTransform,
    freedom: Freedom,
    resolution: f64,
) -> RigidTransform {
    let schedule = Schedule {
        start_radius: GUESS_RADII[0] * resolution,
        end_radius: GUESS_RADII[1] * resolution,
        scale: 0.5 * GUESS_RADII[1] * resolution,
        rounds: GUESS_ROUNDS,
        max_points: GUESS_POINTS,
        min_normal_cosine: 0.5,
        tolerance: 0.02 * resolution,
        freedom,
    };
    PointToPlane { schedule }.refine(&surfaces.source, &surfaces.target, guess).target_from_source
}
