//! Loops of three: what is consistent around a triangle is seldom wrong.
//!
//! Two wrong poses and a right one close a triangle only by chance, so each triangle that closes is a vote for its
//! three candidates. Poses that their registration doubted neither vote nor are elected.

use crate::{Belief, Candidate, Fate, Node, Settings};
use congruent_geometry::RigidTransform;
use nalgebra::Point3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Minimum number of triangles of a candidate for the lack of a closed one to count against it.
const MIN_TRIANGLES: usize = 2;

/// The votes of the loops for one candidate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Votes {
    /// Number of third scans with which it forms a triangle that closes.
    pub(crate) closed: usize,
    /// Number of third scans with which it forms any triangle.
    pub(crate) triangles: usize,
}

impl Votes {
    /// Returns how far to trust a candidate of this confidence: between the extremes of no triangle at all and none
    /// that closes (Laplace's rule of succession).
    pub(crate) fn strength(self, confidence: f64) -> f64 {
        confidence * (1.0 + self.closed as f64) / (2.0 + self.triangles as f64)
    }
}

/// Counts the triangles of each candidate.
pub(crate) fn counted(nodes: &[Node], candidates: &[Candidate], settings: &Settings) -> Vec<Votes> {
    let by_pair = pairs(candidates);
    let partners = partners(nodes.len(), &by_pair);
    let of_pair = |(&(i, j), own): (&(usize, usize), &Vec<usize>)| {
        let mut votes = vec![Votes::default(); own.len()];
        for &k in partners[i].iter().filter(|k| partners[j].binary_search(k).is_ok()) {
            let (one, other) = (&by_pair[&ordered(j, k)], &by_pair[&ordered(k, i)]);
            for (votes, &at) in votes.iter_mut().zip(own) {
                let first = step(&candidates[at], i, j);
                let closes = one.iter().any(|&b| {
                    let second = step(&candidates[b], j, k);
                    other.iter().any(|&c| {
                        closes(nodes, [i, j, k], [first, second, step(&candidates[c], k, i)], settings.agreement)
                    })
                });
                votes.triangles += 1;
                votes.closed += usize::from(closes);
            }
        }
        own.iter().copied().zip(votes).collect::<Vec<_>>()
    };
    let counts: Vec<Vec<(usize, Votes)>> = by_pair.par_iter().map(of_pair).collect();
    let mut all = vec![Votes::default(); candidates.len()];
    counts.into_iter().flatten().for_each(|(at, votes)| all[at] = votes);
    all
}

/// Determines the fate of the candidates from their votes: at most one per pair is kept.
pub(crate) fn elected(candidates: &[Candidate], votes: &[Votes]) -> Vec<Fate> {
    let mut fates = vec![Fate::Unsupported; candidates.len()];
    for own in pairs(candidates).values() {
        let rank = |at: usize| (votes[at].closed, candidates[at].confidence);
        let best = own.iter().copied().reduce(|a, b| if rank(b) > rank(a) { b } else { a });
        for &at in own {
            fates[at] = fate(&candidates[at], votes[at], best == Some(at));
        }
    }
    fates
}

fn fate(candidate: &Candidate, votes: Votes, is_best: bool) -> Fate {
    let needs_votes = candidate.belief != Belief::Believed;
    if votes.closed == 0 && votes.triangles >= MIN_TRIANGLES {
        Fate::NoLoop { triangles: votes.triangles }
    } else if !is_best {
        Fate::Outvoted
    } else if needs_votes && votes.closed == 0 {
        Fate::Unsupported
    } else {
        Fate::Kept
    }
}

/// Returns the candidates that may vote, by their two scans, the lower one first.
fn pairs(candidates: &[Candidate]) -> BTreeMap<(usize, usize), Vec<usize>> {
    let mut by_pair: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (at, candidate) in candidates.iter().enumerate().filter(|(_, c)| c.belief != Belief::Doubted) {
        by_pair.entry(ordered(candidate.source, candidate.target)).or_default().push(at);
    }
    by_pair
}

/// Returns, for each scan, the others with which it forms a pair, ascending.
fn partners(n: usize, by_pair: &BTreeMap<(usize, usize), Vec<usize>>) -> Vec<Vec<usize>> {
    let mut partners = vec![Vec::new(); n];
    for &(i, j) in by_pair.keys() {
        partners[i].push(j);
        partners[j].push(i);
    }
    partners.iter_mut().for_each(|list| list.sort_unstable());
    partners
}

fn ordered(a: usize, b: usize) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Returns the candidate as a motion from one of its scans to the other.
fn step(candidate: &Candidate, from: usize, to: usize) -> RigidTransform {
    debug_assert!(ordered(candidate.source, candidate.target) == ordered(from, to));
    if candidate.source == from { candidate.target_from_source } else { candidate.target_from_source.inverse() }
}

/// Returns whether three steps around a triangle lead back, seen from each of its corners.
fn closes(nodes: &[Node], corners: [usize; 3], steps: [RigidTransform; 3], limit: f64) -> bool {
    (0..3).all(|at| {
        let [first, second, third] = [0, 1, 2].map(|turn| steps[(at + turn) % 3]);
        displacement(&nodes[corners[at]], &(third * second * first), &RigidTransform::identity()) <= limit
    })
}

/// Returns the mean distance between where two motions put the probe points; zero without any.
pub(crate) fn displacement(node: &Node, a: &RigidTransform, b: &RigidTransform) -> f64 {
    let off = |p: &nalgebra::Vector3<f64>| (a * Point3::from(*p) - b * Point3::from(*p)).norm();
    node.probes.iter().map(off).sum::<f64>() / node.probes.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{candidate, moved_apart, nodes};

    /// Four scans in the same pose; every candidate is the identity except for those named.
    fn square(wrong: &[(usize, usize)]) -> Vec<Candidate> {
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        let pose = |pair| {
            if wrong.contains(&pair) { moved_apart(3 + pair.1 as u64, 60.0, 1.0) } else { RigidTransform::identity() }
        };
        pairs.iter().map(|&pair| candidate(pair.0, pair.1, pose(pair), Belief::Believed)).collect()
    }

    #[test]
    fn a_wrong_pose_closes_no_triangle_and_the_others_lose_one() {
        let (candidates, settings) = (square(&[(0, 1)]), Settings::new(1.0));
        let votes = counted(&nodes(4), &candidates, &settings);
        let closed: Vec<usize> = votes.iter().map(|v| v.closed).collect();
        assert_eq!(closed, [0, 1, 1, 1, 1, 2]);
        assert!(votes.iter().all(|v| v.triangles == 2));
        let fates = elected(&candidates, &votes);
        assert_eq!(fates[0], Fate::NoLoop { triangles: 2 });
        assert!(fates[1..].iter().all(|fate| *fate == Fate::Kept));
    }

    #[test]
    fn one_triangle_is_too_few_to_drop_what_is_believed() {
        let three: Vec<Candidate> = square(&[(0, 1)]).into_iter().filter(|c| c.source != 3 && c.target != 3).collect();
        let votes = counted(&nodes(3), &three, &Settings::new(1.0));
        assert_eq!(votes[0], Votes { closed: 0, triangles: 1 });
        assert!(elected(&three, &votes).iter().all(|fate| *fate == Fate::Kept));
    }

    #[test]
    fn of_several_poses_the_one_with_most_triangles_is_chosen() {
        let mut candidates = square(&[]);
        candidates[0].belief = Belief::Uncertain;
        let mut rival = candidate(1, 0, moved_apart(8, 50.0, 2.0), Belief::Uncertain);
        rival.confidence = 1.0;
        candidates.push(rival);
        let votes = counted(&nodes(4), &candidates, &Settings::new(1.0));
        assert_eq!((votes[0].closed, votes[6].closed), (2, 0));
        let fates = elected(&candidates, &votes);
        assert_eq!((fates[0], fates[6]), (Fate::Kept, Fate::NoLoop { triangles: 2 }));
        // Without a third scan nothing decides between them.
        let alone = [candidates[0].clone(), candidates[6].clone()];
        let votes = counted(&nodes(4), &alone, &Settings::new(1.0));
        assert!(!elected(&alone, &votes).contains(&Fate::Kept));
    }

    #[test]
    fn what_was_doubted_does_not_vote() {
        let mut candidates = square(&[]);
        candidates[5].belief = Belief::Doubted;
        let votes = counted(&nodes(4), &candidates, &Settings::new(1.0));
        assert_eq!(votes.iter().map(|v| v.triangles).collect::<Vec<_>>(), [2, 1, 1, 1, 1, 0]);
        assert_eq!(elected(&candidates, &votes)[5], Fate::Unsupported);
    }
}
