//! The last refinement, on the scans as they came.

use crate::{Pair, PointToPlaneConfig};
use congruent_geometry::{NeighborIndex, Point, RigidTransform, Surface};
use rayon::prelude::*;

/// Points of the target that are searched for the nearest one; a denser scan is thinned evenly.
const MAX_TARGET_POINTS: usize = 300_000;
/// The robust support of a pose may not fall below this share of what it was.
const MIN_SUPPORT: f64 = 0.999;

/// Moves the source as it came onto the target as it came; the start is kept where the surfaces lose touch.
///
/// Normals are those of the sampled surfaces, which are smoother than what so few raw points would give.
pub(crate) fn refined(
    points: &Pair<&[Point]>,
    sampled: &Pair<Surface>,
    config: &PointToPlaneConfig,
    resolution: f64,
    start: &RigidTransform,
) -> RigidTransform {
    let limits = Pair { source: config.points, target: MAX_TARGET_POINTS };
    let whole = points
        .zip(sampled.as_ref())
        .zip(limits)
        .map(|&((points, sampled), limit)| with_normals(points, sampled, limit));
    let icp = config.build(resolution);
    let (moving, fixed) = (&whole.source, &whole.target);
    let end = icp.refine(moving, fixed, fixed.index(), start).target_from_source;
    let support = |pose: &RigidTransform| icp.measure(moving, fixed, fixed.index(), pose).support;
    if support(&end) >= MIN_SUPPORT * support(start) { end } else { *start }
}

/// At most `limit` of the points, evenly spread over their order, each with the normal of the nearest sampled point.
pub(crate) fn with_normals(points: &[Point], sampled: &Surface, limit: usize) -> Surface {
    let stride = points.len().div_ceil(limit.max(1)).max(1);
    let points: Vec<Point> = points.iter().step_by(stride).copied().collect();
    let normal = |p: &Point| sampled.index().nearest(p).map_or([0.0; 3], |n| sampled.normals()[n.index as usize]);
    let (normals, index) = rayon::join(|| points.par_iter().map(normal).collect(), || NeighborIndex::new(&points));
    Surface::new(points, normals, index, sampled.resolution())
}
