//! From registered pairs to the candidates of the pose graph.

use crate::Surfaces;
use congruent_geometry::RigidTransform;
use congruent_multiway::{Belief, Candidate};
use congruent_pipeline::VerdictKind;
use rayon::prelude::*;

/// The outcome of one registered pair. Scans are positions in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Registered {
    /// The scan that moves.
    pub source: usize,
    /// The scan that stays.
    pub target: usize,
    /// What the registration says of its pose.
    pub verdict: VerdictKind,
    /// In the first pose.
    pub confidence: f64,
    /// `target_from_source` in file coordinates, the best first; the others are those of an ambiguous pair.
    pub poses: Vec<RigidTransform>,
}

/// One pose that a registered pair proposes.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// The position of the pair in the list of pairs.
    pub pair: usize,
    /// How probable it is that the pose is right.
    pub confidence: f64,
    /// What enters the graph; nothing where the surfaces do not touch under the pose.
    pub candidate: Option<Candidate>,
}

/// All poses of all pairs, in their order.
///
/// # Panics
/// When a pair names a scan that is not there.
#[must_use]
pub fn proposals(pairs: &[Registered], surfaces: &Surfaces) -> Vec<Proposal> {
    let proposed = |(at, pair): (usize, &Registered)| -> Vec<Proposal> {
        let &Registered { source, target, verdict, .. } = pair;
        let one = |(rank, pose): (usize, &RigidTransform)| {
            // Later ones are a little less likely.
            let confidence = pair.confidence / (1.0 + rank as f64);
            let target_from_source = surfaces.centred(source, target, pose);
            let touch = surfaces.touch(source, target, &target_from_source);
            let belief = belief(verdict);
            let candidate =
                touch.map(|touch| Candidate { source, target, target_from_source, touch, confidence, belief });
            Proposal { pair: at, confidence, candidate }
        };
        pair.poses.iter().enumerate().map(one).collect()
    };
    pairs.par_iter().enumerate().map(proposed).collect::<Vec<_>>().into_iter().flatten().collect()
}

fn belief(verdict: VerdictKind) -> Belief {
    match verdict {
        VerdictKind::Ok => Belief::Believed,
        VerdictKind::Ambiguous => Belief::Uncertain,
        VerdictKind::Failed => Belief::Doubted,
    }
}
