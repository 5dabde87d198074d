//! Joins components by doubtful pairs, if several of them agree.
//!
//! A pose that its own registration did not believe tells where the whole component of its source would lie in the
//! frame of its target's. One such statement is not enough; two or more pairs that name the same pose, and outnumber
//! those that name any other, are.

use crate::votes::displacement;
use crate::{Belief, Candidate, Fate, Node, Settings};
use congruent_geometry::RigidTransform;
use std::collections::{BTreeMap, BTreeSet};

/// Minimum confidence of a doubted pose to be considered: half of that from which registrations are believed.
const MIN_CONFIDENCE: f64 = 0.3;
/// Surfaces of one object are equally close to each other everywhere; those that are more than this many times as far
/// apart as the kept ones (their median) belong to two objects that resemble each other.
const MAX_RESIDUAL: f64 = 2.5;

/// One candidate between two components, from the later one into the earlier one.
struct Bridge {
    candidate: usize,
    /// Scan of the later component.
    beyond: usize,
    near_from_beyond: RigidTransform,
}

/// Returns the candidates whose agreement joins two components: of all pairs of components, the two that are joined by
/// the most pairs of scans. Empty if no two can be joined.
pub(crate) fn strongest(
    nodes: &[Node],
    candidates: &[Candidate],
    fates: &[Fate],
    poses: &[RigidTransform],
    components: &[Vec<usize>],
    settings: &Settings,
) -> Vec<usize> {
    let within = MAX_RESIDUAL * kept_residual(candidates, fates).unwrap_or(f64::INFINITY);
    let mut between: BTreeMap<(usize, usize), Vec<Bridge>> = BTreeMap::new();
    let mut component_of = vec![0; nodes.len()];
    for (number, members) in components.iter().enumerate() {
        members.iter().for_each(|&node| component_of[node] = number);
    }
    for (at, candidate) in candidates.iter().enumerate() {
        let likely = candidate.belief == Belief::Uncertain || candidate.confidence >= MIN_CONFIDENCE;
        let plausible = likely && candidate.touch.residual <= within;
        let weak = candidate.belief != Belief::Believed && plausible && fates[at] != Fate::Kept;
        let (source, target) = (component_of[candidate.source], component_of[candidate.target]);
        if !weak || source == target {
            continue;
        }
        let forth = poses[candidate.target] * candidate.target_from_source * poses[candidate.source].inverse();
        let bridge = if target < source {
            Bridge { candidate: at, beyond: candidate.source, near_from_beyond: forth }
        } else {
            Bridge { candidate: at, beyond: candidate.target, near_from_beyond: forth.inverse() }
        };
        between.entry((source.min(target), source.max(target))).or_default().push(bridge);
    }
    let found = between.values().filter_map(|bridges| agreed(nodes, candidates, poses, bridges, settings));
    // The earliest of the strongest.
    found.reduce(|a, b| if b.0 > a.0 { b } else { a }).map(|(_, members)| members).unwrap_or_default()
}

/// Returns the median residual of the kept candidates; `None` without any.
fn kept_residual(candidates: &[Candidate], fates: &[Fate]) -> Option<f64> {
    let kept = candidates.iter().zip(fates).filter(|(_, fate)| **fate == Fate::Kept);
    let mut residuals: Vec<f64> = kept.map(|(candidate, _)| candidate.touch.residual).collect();
    residuals.sort_by(f64::total_cmp);
    residuals.get(residuals.len() / 2).copied()
}

/// The number of pairs of scans that agree, and the sum of their confidences.
type Weight = (usize, f64);

/// Returns the largest set of bridges that agree, if it is large enough and no other is as large.
fn agreed(
    nodes: &[Node],
    candidates: &[Candidate],
    poses: &[RigidTransform],
    bridges: &[Bridge],
    settings: &Settings,
) -> Option<(Weight, Vec<usize>)> {
    let agree = |a: &Bridge, b: &Bridge| {
        [a, b].iter().all(|from| {
            let node = &nodes[from.beyond];
            let place = |bridge: &Bridge| bridge.near_from_beyond * poses[from.beyond];
            displacement(node, &place(a), &place(b)) <= settings.agreement
        })
    };
    let weigh = |members: &[usize]| -> Weight {
        let pairs: BTreeSet<(usize, usize)> =
            members.iter().map(|&at| (candidates[at].source, candidates[at].target)).collect();
        (pairs.len(), members.iter().map(|&at| candidates[at].confidence).sum())
    };
    let sets = bridges.iter().map(|centre| {
        let members: Vec<usize> = bridges.iter().filter(|b| agree(centre, b)).map(|b| b.candidate).collect();
        (weigh(&members), members, centre)
    });
    let sets: Vec<_> = sets.collect();
    let best = sets.iter().reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    let rivals = sets.iter().filter(|set| !agree(best.2, set.2)).map(|set| set.0.0).max().unwrap_or(0);
    (best.0.0 >= settings.witnesses && best.0.0 > rivals).then(|| (best.0, best.1.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{candidate, moved_apart, nodes};

    /// Two components of two scans each, all truly in the same pose, and doubtful poses between them.
    fn joined(doubtful: &[(usize, usize, RigidTransform)]) -> Vec<usize> {
        let candidates: Vec<Candidate> =
            doubtful.iter().map(|&(source, target, pose)| candidate(source, target, pose, Belief::Doubted)).collect();
        let fates = vec![Fate::Unsupported; candidates.len()];
        let components = [vec![0, 1], vec![2, 3]];
        let poses = [RigidTransform::identity(); 4];
        strongest(&nodes(4), &candidates, &fates, &poses, &components, &Settings::new(1.0))
    }

    #[test]
    fn two_pairs_that_agree_join_and_one_does_not() {
        let right = RigidTransform::identity();
        let wrong = |seed| moved_apart(seed, 70.0, 1.5);
        assert_eq!(joined(&[(2, 0, right), (3, 0, wrong(1)), (1, 3, right)]), [0, 2]);
        assert!(joined(&[(2, 0, right), (3, 0, wrong(1)), (1, 3, wrong(2))]).is_empty());
        assert!(joined(&[(2, 0, right), (2, 0, right)]).is_empty(), "two poses of one pair are one word");
        assert!(joined(&[]).is_empty());
    }

    #[test]
    fn surfaces_that_part_more_than_those_that_are_kept_join_nothing() {
        let right = RigidTransform::identity();
        let joined = |residual: f64| {
            let mut candidates =
                [(1, 0, Belief::Believed), (3, 2, Belief::Believed), (2, 0, Belief::Doubted), (3, 1, Belief::Doubted)]
                    .map(|(source, target, belief)| candidate(source, target, right, belief));
            candidates.iter_mut().for_each(|c| c.touch.residual = 0.1);
            candidates[2..].iter_mut().for_each(|c| c.touch.residual = residual);
            let fates = [Fate::Kept, Fate::Kept, Fate::Unsupported, Fate::Unsupported];
            let poses = [right; 4];
            strongest(&nodes(4), &candidates, &fates, &poses, &[vec![0, 1], vec![2, 3]], &Settings::new(1.0))
        };
        assert_eq!(joined(0.2), [2, 3]);
        assert!(joined(0.3).is_empty());
    }

    #[test]
    fn a_tie_joins_nothing() {
        let (one, other) = (RigidTransform::identity(), moved_apart(4, 70.0, 1.5));
        assert!(joined(&[(2, 0, one), (3, 0, other), (2, 1, other), (3, 1, one)]).is_empty());
        assert_eq!(joined(&[(2, 0, one), (3, 0, one), (2, 1, other), (3, 1, one)]), [0, 1, 3]);
    }
}
