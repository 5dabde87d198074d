//! From two scans and a rough pose to an exact one: the chain without the search.

use crate::chain::Proposals;
use crate::memory::Memory;
use crate::register::attempt;
use crate::stage::Clock;
use crate::{Pair, PipelineConfig, Prior, Registration, Signs, Stage, Trace};
use congruent_geometry::Scan;

/// Refines the prior's guess and judges the result; no other pose is searched for.
///
/// The guess is refined from coarse to fine, within the prior's bounds; if the result is not accepted, also with the
/// other side of uncertain normals. The verdict is reached as in [`register`](crate::register), from how well the
/// surfaces fit each other and how many of their correspondences are inliers; it is never `Ambiguous`, because there is
/// no other pose to compare with. `observe` is called with each stage as it begins.
///
/// # Panics
/// If the prior has no guess.
#[must_use]
pub fn refine(
    scans: Pair<&Scan>,
    prior: &Prior,
    config: &PipelineConfig,
    observe: &dyn Fn(Stage),
) -> (Registration, Trace) {
    assert!(prior.guess.is_some(), "a refinement needs a start");
    let origins = scans.map(|scan| *scan.origin());
    let mut clock = Clock::new(observe);
    let bounds = prior.bounds(&origins);
    let mut memory = Memory::default();
    let mut refined =
        |signs: Signs| attempt(&scans, &bounds, Proposals::Guessed, config, signs, &mut memory, &mut clock);
    let mut best = refined(Signs::Kept).expect("an attempt with the signs as they are is made");
    if !best.is_believed()
        && let Some(other) = refined(Signs::Other)
    {
        best = best.or(other);
    }
    let trace = std::mem::take(&mut best.trace);
    (best.registration(&origins, clock), trace)
}
