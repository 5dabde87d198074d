//! The last refinement, on the scans as they came.

use crate::Pair;
use congruent_geometry::{NeighborIndex, Point, RigidTransform, Surface};
use congruent_refinement::{Freedom, PointToPlane, Refinement, Refiner, Schedule};
use rayon::prelude::*;

/// Points of the target that are searched for the nearest one; a denser scan is thinned evenly.
const MAX_TARGET_POINTS: usize = 300_000;

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

/// Moves the source as it came onto the target as it came; the start is kept where the surfaces lose touch.
///
/// Normals are those of the sampled surfaces, which are smoother than what so few raw points would give.
pub(crate) fn refined(
    points: &Pair<&[Point]>,
    sampled: &Pair<Surface>,
    refiner: &dyn Refiner,
    start: &RigidTransform,
) -> Refinement {
    let limits = Pair { source: 15_000, target: MAX_TARGET_POINTS };
    let whole = points
        .zip(sampled.as_ref())
        .zip(limits)
        .map(|&((points, sampled), limit)| with_normals(points, sampled, limit));
    refiner.refine(&whole.source, &whole.target, start)
}

/// At most `limit` of the points, evenly spread over their order, each with the normal of the nearest sampled point.
fn with_normals(points: &[Point], sampled: &Surface, limit: usize) -> Surface {
    let stride = points.len().div_ceil(limit.max(1)).max(1);
    let points: Vec<Point> = points.iter().step_by(stride).copied().collect();
    let normal = |p: &Point| sampled.index().nearest(p).map_or([0.0; 3], |n| sampled.normals()[n.index as usize]);
    let (normals, index) = rayon::join(|| points.par_iter().map(normal).collect(), || NeighborIndex::new(&points));
    Surface::new(points, normals, index, sampled.resolution())
}
