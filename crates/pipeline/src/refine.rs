//! From two scans and a rough pose to an exact one: the chain without its search.

use crate::chain::Proposals;
use crate::memory::Memory;
use crate::register::attempt;
use crate::stage::Clock;
use crate::{Pair, PipelineConfig, Prior, Registration, Signs, Stage, Trace};
use congruent_geometry::Scan;

/// Refines the prior's guess and says what is to be thought of it; no other pose is looked for.
///
/// The guess is moved from coarse to fine, within the prior's bounds. The verdict is that of
/// [`register`](crate::register), from the surfaces and from how many of their correspondences agree; it is never
/// `Ambiguous`, because there is nothing to compare with.
///
/// # Panics
/// For a prior without a guess.
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
    let mut only =
        attempt(&scans, &bounds, Proposals::Guessed, config, Signs::Kept, &mut Memory::default(), &mut clock)
            .expect("an attempt with the signs as they are is made");
    let trace = std::mem::take(&mut only.trace);
    (only.registration(&origins, clock), trace)
}
