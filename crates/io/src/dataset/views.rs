//! Data sets that give each scan's place in a common frame: every pair of scans has a truth.

use super::{Listed, Truth};
use crate::Motion;
use congruent_geometry::RigidTransform;

/// A scan and its place.
pub(super) struct View {
    pub(super) name: String,
    /// Where the place is written.
    pub(super) place: String,
    pub(super) world_from_scan: RigidTransform,
    /// How far what is written is from a rigid motion.
    pub(super) skew: f64,
}

/// Each pair of views once, the later one as the source; then the views that cannot be used.
pub(super) fn all_pairs<E>(views: impl Iterator<Item = Result<View, E>>) -> Listed<E> {
    let (good, bad): (Vec<_>, Vec<_>) = views.partition(Result::is_ok);
    let good: Vec<View> = good.into_iter().filter_map(Result::ok).collect();
    let mut truths = Listed::new();
    for (i, target) in good.iter().enumerate() {
        for source in &good[i + 1..] {
            let pose = target.world_from_scan.inverse() * source.world_from_scan;
            let skew = source.skew.max(target.skew);
            let [place, source, target] = [&source.place, &source.name, &target.name].map(String::clone);
            truths.push(Ok(Truth { id: None, source, target, place, overlap: None, motion: Motion { pose, skew } }));
        }
    }
    truths.extend(bad.into_iter().filter_map(Result::err).map(Err));
    truths
}
