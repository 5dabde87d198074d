//! From scans to their poses in one frame.

use crate::{Conflict, Judged, Registered, Solved, Surfaces, proposals};
use congruent_geometry::{RigidTransform, Scan};
use congruent_pipeline::{Collection, DescribedScan, Pair, PipelineConfig, Prior, Registration, ScanSummary, Variant};
use rayon::prelude::*;
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};

/// All scans, in as few frames as their connections allow.
#[derive(Clone, Debug)]
pub struct Model {
    /// Connected scans, ascending; the largest component first. A scan that fits nowhere is a component of its own.
    pub components: Vec<Vec<usize>>,
    /// For each scan, the motion from its file's coordinates into those of the first scan of its component.
    pub frame_from_scan: Vec<RigidTransform>,
    /// For each scan, a lower bound of the error of its points relative to those of the component's first scan: root
    /// mean square, data units. `None` if it is unknown.
    pub uncertainty: Vec<Option<f64>>,
    /// Scans of a component that contradict each other under their poses, the largest contradiction first. If there are
    /// any, the poses may be wrong.
    pub conflicts: Vec<Conflict>,
    /// The outcome of each pair, ordered by target, then by source, which is always the later scan.
    pub pairs: Vec<Registered>,
    /// What became of each pose of each pair, in the order of the pairs.
    pub proposals: Vec<Judged>,
}

/// Registers every pair of scans and puts all scans into one frame, as far as the pairs connect them.
///
/// The result depends only on the scans, their order and the configuration, not on the number of threads. All scans are
/// kept in memory with their descriptors. A scan that cannot be sampled stays alone; so do all scans if no pair is
/// registered.
///
/// ```
/// use congruent_geometry::Scan;
/// use congruent_pipeline::PipelineConfig;
/// use congruent_reconstruction::reconstruct;
/// use congruent_simulation::pair::{PairOptions, figurine_pair};
///
/// let pair = figurine_pair(&PairOptions { pixels: 120, ..PairOptions::default() });
/// let scans = [Scan::new(&pair.source)?, Scan::new(&pair.target)?];
/// let model = reconstruct(&scans, &PipelineConfig::default());
/// assert_eq!(model.components, [[0, 1]]);
/// println!("{}", model.frame_from_scan[1]);
/// # Ok::<(), congruent_geometry::ScanError>(())
/// ```
#[must_use]
pub fn reconstruct(scans: &[Scan], config: &PipelineConfig) -> Model {
    let summaries: Vec<Option<ScanSummary>> =
        scans.par_iter().map(|scan| ScanSummary::new(scan, config).ok()).collect();
    let usable: Vec<ScanSummary> = summaries.iter().flatten().cloned().collect();
    let Some(collection) = Collection::new(&usable, config) else { return alone(scans.len()) };
    let shelf = Shelf { scans, collection: &collection, described: Mutex::default() };
    let is_usable = |at: &usize| summaries[*at].is_some();
    let pairs: Vec<[usize; 2]> = (0..scans.len())
        .filter(is_usable)
        .flat_map(|target| (target + 1..scans.len()).filter(is_usable).map(move |source| [source, target]))
        .collect();
    let registered = |&[source, target]: &[usize; 2]| {
        let supply_source = |variant| Ok::<_, Infallible>(shelf.get(source, variant));
        let supply_target = |variant| Ok::<_, Infallible>(shelf.get(target, variant));
        let supply = Pair::<&dyn Fn(Variant) -> _> { source: &supply_source, target: &supply_target };
        let Ok(found) = collection.register(supply, config.seed, &Prior::default(), &|_| ());
        outcome(source, target, &found)
    };
    let pairs: Vec<Registered> = pairs.par_iter().map(registered).collect();
    let described = |at: usize| is_usable(&at).then(|| shelf.get(at, Variant::default()));
    let surfaces = Surfaces::new(scans.len(), described, collection.resolution());
    let Solved { proposals, result, conflicts } = Solved::new(proposals(&pairs, &surfaces), &surfaces);
    let mut frame_from_scan = vec![RigidTransform::identity(); scans.len()];
    for members in &result.components {
        members.iter().for_each(|&at| frame_from_scan[at] = surfaces.in_files(&result, at, members[0]));
    }
    let (components, uncertainty) = (result.components, result.uncertainty);
    Model { components, frame_from_scan, uncertainty, conflicts, pairs, proposals }
}

fn alone(n: usize) -> Model {
    Model {
        components: (0..n).map(|at| vec![at]).collect(),
        frame_from_scan: vec![RigidTransform::identity(); n],
        uncertainty: vec![None; n],
        conflicts: Vec::new(),
        pairs: Vec::new(),
        proposals: Vec::new(),
    }
}

fn outcome(source: usize, target: usize, found: &Registration) -> Registered {
    let others = found.alternatives().iter().map(|other| other.target_from_source);
    Registered {
        source,
        target,
        verdict: found.verdict(),
        confidence: found.confidence(),
        poses: found.pose().copied().into_iter().chain(others).collect(),
    }
}

/// Described scans, computed when a pair first needs them.
struct Shelf<'a> {
    scans: &'a [Scan],
    collection: &'a Collection,
    described: Mutex<HashMap<(usize, Variant), Arc<DescribedScan>>>,
}

impl Shelf<'_> {
    fn get(&self, at: usize, variant: Variant) -> Arc<DescribedScan> {
        let known = || self.described.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(described) = known().get(&(at, variant)) {
            return described.clone();
        }
        // Not under the lock, because describing runs on several threads. If two threads describe the same scan, their
        // results are identical.
        let made = Arc::new(self.collection.describe(&self.scans[at], variant));
        known().entry((at, variant)).or_insert(made).clone()
    }
}
