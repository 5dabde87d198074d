//! Turns registered pairs into candidates for the pose graph.

use crate::Surfaces;
use congruent_geometry::RigidTransform;
use congruent_multiway::{Belief, Candidate};
use congruent_pipeline::Verdict;
use rayon::prelude::*;

/// The outcome of one registered pair. Scans are given by their position in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Registered {
    /// The scan that moves.
    pub source: usize,
    /// The scan that stays.
    pub target: usize,
    /// The verdict of the registration on its pose.
    pub verdict: Verdict,
    /// Confidence in the first pose.
    pub confidence: f64,
    /// `target_from_source` in file coordinates, best first; further poses are the alternatives of an ambiguous pair.
    pub poses: Vec<RigidTransform>,
}

/// One pose proposed by a registered pair.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Position of the pair in the list of pairs.
    pub pair: usize,
    /// Estimated probability that the pose is right.
    pub confidence: f64,
    /// The candidate for the graph; `None` if the surfaces do not touch under the pose.
    pub candidate: Option<Candidate>,
}

/// Returns a proposal for every pose of every pair, in the order of the pairs.
///
/// # Panics
/// If a pair refers to a scan that does not exist.
#[must_use]
pub fn proposals(pairs: &[Registered], surfaces: &Surfaces) -> Vec<Proposal> {
    let proposed = |(at, pair): (usize, &Registered)| -> Vec<Proposal> {
        let &Registered { source, target, verdict, .. } = pair;
        let one = |(rank, pose): (usize, &RigidTransform)| {
            // Later poses get a half, a third … of the confidence.
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

fn belief(verdict: Verdict) -> Belief {
    match verdict {
        Verdict::Ok => Belief::Believed,
        Verdict::Ambiguous => Belief::Uncertain,
        Verdict::Failed => Belief::Doubted,
    }
}
