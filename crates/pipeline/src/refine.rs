//! From two scans and a rough pose to an exact one: the chain without the search.

use crate::chain::Proposals;
use crate::memory::Memory;
use crate::register::attempt;
use crate::stage::Clock;
use crate::{Guess, Pair, PipelineConfig, Prior, Registration, Signs, Stage, Trace};
use congruent_geometry::Scan;
use nalgebra::{Unit, Vector3};

/// Refines a guess and judges the result; no other pose is searched for.
///
/// The guess is refined from coarse to fine, within its bounds; if the result is not accepted, also with the other side
/// of uncertain normals. The verdict is reached as in [`register`](crate::register), from how well the surfaces fit each
/// other and how many of their correspondences are inliers; it is never `Ambiguous`, because there is no other pose to
/// compare with.
#[must_use]
pub fn refine(source: &Scan, target: &Scan, start: &Guess, config: &PipelineConfig) -> Registration {
    refine_traced(Pair { source, target }, start, None, config, &|_| ()).0
}

/// Refines a guess as [`refine`] does, and also returns what the stages produced.
///
/// `up` is the direction that is up in both scans, if they are levelled: see [`Prior::up`]. `observe` is called with
/// each stage as it begins.
#[must_use]
pub fn refine_traced(
    scans: Pair<&Scan>,
    start: &Guess,
    up: Option<Unit<Vector3<f64>>>,
    config: &PipelineConfig,
    observe: &dyn Fn(Stage),
) -> (Registration, Trace) {
    let prior = &Prior { guess: Some(start.clone()), up };
    let origins = scans.map(|scan| *scan.origin());
    let mut clock = Clock::new(observe);
    let mut memory = Memory::default();
    let mut refined = |signs: Signs| attempt(&scans, prior, Proposals::Guessed, config, signs, &mut memory, &mut clock);
    let mut best = refined(Signs::Kept).expect("an attempt with the signs as they are is made");
    if !best.is_believed()
        && let Some(other) = refined(Signs::Other)
    {
        best = best.or(other);
    }
    let trace = std::mem::take(&mut best.trace);
    (best.registration(&origins, clock), trace)
}
