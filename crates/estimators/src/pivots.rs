//! Poses from triangles of the compatibility graph, the best connected first.
//!
//! An edge between two right correspondences has all other right ones as common neighbours, an accidental edge few. So
//! the edges with the most common neighbours are the pivots, and each proposes the two triangles that are best connected
//! (after TurboReg, Yan et al. 2025).

use crate::commons::Commons;
use crate::{Graph, HypothesisGenerator};
use congruent_geometry::{RigidTransform, fit_three};
use congruent_metrics::Evidence;
use rayon::prelude::*;

/// Edges of a node that are considered.
const EDGES_PER_NODE: usize = 40;
/// Triangles that a pivot proposes.
const THIRDS: usize = 2;

/// Proposes one pose for each of a fixed list of triangles.
pub struct Pivots<'a> {
    evidence: &'a Evidence,
    triangles: Vec<[u32; 3]>,
}

/// An edge and how many neighbours its ends share.
#[derive(Clone, Copy)]
struct Edge {
    common: u32,
    ends: [u32; 2],
}

impl<'a> Pivots<'a> {
    /// Finds at most `limit` pivots in the graph, which is one of `evidence`.
    #[must_use]
    pub fn new(evidence: &'a Evidence, graph: &Graph, limit: usize) -> Self {
        let commons = Commons::new(graph);
        let pivots = pivots(graph.len(), &commons, limit);
        Pivots { evidence, triangles: triangles(graph.len(), &commons, &pivots) }
    }
}

impl HypothesisGenerator for Pivots<'_> {
    fn trials(&self) -> u64 {
        self.triangles.len() as u64
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let corners = self.triangles.get(usize::try_from(trial).ok()?)?.map(|i| i as usize);
        fit_three(&corners.map(|i| self.evidence.source(i)), &corners.map(|i| self.evidence.target(i)))
    }
}

/// Each node's best edge first (so that no part of the scan is left out), up to half of the limit; then the best of
/// the others.
fn pivots(n: usize, commons: &Commons<'_>, limit: usize) -> Vec<Edge> {
    let by_node: Vec<Vec<Edge>> = (0..n).into_par_iter().map(|i| best_edges(commons, i)).collect();
    let mut firsts: Vec<Edge> = by_node.iter().filter_map(|edges| edges.first().copied()).collect();
    keep_best(&mut firsts, limit / 2);
    let mut others: Vec<Edge> = by_node.iter().flat_map(|edges| edges.iter().skip(1).copied()).collect();
    keep_best(&mut others, limit - firsts.len());
    firsts.extend(others);
    firsts
}

/// The edges of a node to later nodes, best connected first.
fn best_edges(commons: &Commons<'_>, i: usize) -> Vec<Edge> {
    let later = commons.neighbors(i).filter(|&(j, _)| j > i);
    let mut edges: Vec<Edge> = later.map(|(j, common)| Edge { common, ends: [i as u32, j as u32] }).collect();
    keep_best(&mut edges, EDGES_PER_NODE);
    edges
}

/// The best connected first; of equals the first in the graph.
fn keep_best(edges: &mut Vec<Edge>, n: usize) {
    let better = |a: &Edge, b: &Edge| b.common.cmp(&a.common).then(a.ends.cmp(&b.ends));
    if 0 < n && n < edges.len() {
        edges.select_nth_unstable_by(n, better);
    }
    edges.truncate(n);
    edges.sort_unstable_by(better);
}

/// Each pivot with its best connected common neighbours, in the order of the pivots.
fn triangles(n: usize, commons: &Commons<'_>, pivots: &[Edge]) -> Vec<[u32; 3]> {
    let mut by_node: Vec<usize> = (0..pivots.len()).collect();
    by_node.sort_by_key(|&pivot| pivots[pivot].ends[0]);
    let groups: Vec<&[usize]> = by_node.chunk_by(|&a, &b| pivots[a].ends[0] == pivots[b].ends[0]).collect();
    // What the edges of the pivots' first end count; nothing where there is no edge.
    let spread = || vec![None::<u32>; n];
    let mut thirds: Vec<(usize, Vec<usize>)> = groups
        .into_par_iter()
        .map_init(spread, |counts, group| {
            let first = pivots[group[0]].ends[0] as usize;
            commons.neighbors(first).for_each(|(k, count)| counts[k] = Some(count));
            let found: Vec<_> = group.iter().map(|&pivot| (pivot, thirds(commons, &pivots[pivot], counts))).collect();
            commons.neighbors(first).for_each(|(k, _)| counts[k] = None);
            found
        })
        .flatten_iter()
        .collect();
    thirds.sort_unstable_by_key(|&(pivot, _)| pivot);
    let triangle = |(pivot, third): (usize, usize)| [pivots[pivot].ends[0], pivots[pivot].ends[1], third as u32];
    thirds.into_iter().flat_map(|(pivot, thirds)| thirds.into_iter().map(move |k| triangle((pivot, k)))).collect()
}

/// The best connected common neighbours of an edge; of equals the first. `counts` are those of its first end.
fn thirds(commons: &Commons<'_>, edge: &Edge, counts: &[Option<u32>]) -> Vec<usize> {
    let mut best: Vec<(u32, usize)> = Vec::with_capacity(THIRDS + 1);
    for (k, with_second) in commons.neighbors(edge.ends[1] as usize) {
        let Some(with_first) = counts[k] else { continue };
        let common = with_first + with_second;
        let place = best.partition_point(|other| other.0 >= common);
        if place < THIRDS {
            best.insert(place, (common, k));
            best.truncate(THIRDS);
        }
    }
    best.into_iter().map(|(_, k)| k).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};
    use crate::sample;
    use congruent_geometry::angle_between;
    use congruent_metrics::{Mse, Summed};

    #[test]
    fn two_right_in_a_hundred_are_enough() {
        for seed in 0..5 {
            let (evidence, truth) = scene(1000, 20, seed);
            let pivots = Pivots::new(&evidence, &Graph::new(&evidence, &RULE), 1000);
            let best = sample(&pivots, &Summed(Mse::new(7.5)), &evidence, 1);
            assert!(angle_between(&best[0].target_from_source, &truth) < 0.01, "seed {seed}");
        }
    }

    #[test]
    fn the_limit_holds_and_nothing_proposes_nothing() {
        let (evidence, _) = scene(300, 40, 9);
        assert!(Pivots::new(&evidence, &Graph::new(&evidence, &RULE), 50).trials() <= 100);
        let none = Evidence::default();
        let pivots = Pivots::new(&none, &Graph::new(&none, &RULE), 50);
        assert!(pivots.trials() == 0 && pivots.propose(0).is_none());
    }
}
