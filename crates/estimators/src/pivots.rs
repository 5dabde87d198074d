//! Poses from triangles of the compatibility graph, the best connected first.
//!
//! An edge between two right correspondences has all other right ones as common neighbours, an accidental edge has few.
//! So the edges with the most common neighbours are the pivots, and each proposes the two triangles that are best
//! connected (after TurboReg, Yan et al. 2025).

use crate::commons::{Commons, Row};
use crate::{Graph, HypothesisGenerator};
use congruent_geometry::{RigidTransform, Spare, fit_three};
use congruent_metrics::Evidence;
use multiversion::multiversion;
use rayon::prelude::*;
use std::borrow::Cow;

/// Maximum number of edges considered per node.
const EDGES_PER_NODE: usize = 40;
/// Maximum number of triangles that a pivot proposes.
const THIRDS: usize = 2;
/// Maximum numbers of nodes and of pivots that one thread takes at a time.
const NODES_AT_A_TIME: usize = 64;
const PIVOTS_AT_A_TIME: usize = 64;

/// Proposes one pose for each of a fixed list of triangles.
pub struct Pivots<'a> {
    evidence: Cow<'a, Evidence>,
    triangles: Vec<[u32; 3]>,
}

/// An edge and the number of neighbours that its ends share.
#[derive(Clone, Copy)]
struct Edge {
    common: u32,
    ends: [u32; 2],
}

impl Edge {
    /// Returns a key whose minimum is the best connected edge; ties go to the first in the graph.
    fn rank(&self) -> u128 {
        let [first, second] = self.ends.map(u128::from);
        u128::from(!self.common) << 64 | first << 32 | second
    }
}

impl<'a> Pivots<'a> {
    /// Finds at most `limit` pivots in the graph, which must be that of `evidence`.
    #[must_use]
    pub fn new(evidence: Cow<'a, Evidence>, graph: &Graph, limit: usize) -> Self {
        let commons = Commons::new(graph);
        let pivots = pivots(graph.len(), &commons, limit);
        Pivots { evidence, triangles: triangles(&commons, &pivots) }
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

/// Returns each node's best edge first (so that no part of the scan is left out), up to half of the limit; then the
/// best of all other edges.
fn pivots(n: usize, commons: &Commons<'_>, limit: usize) -> Vec<Edge> {
    let spare = Spare::default();
    let best_of = |i: usize| spare.with(|edges| best_edges(commons, i, edges));
    let by_node: Vec<Vec<Edge>> = (0..n).into_par_iter().with_max_len(NODES_AT_A_TIME).map(best_of).collect();
    let mut firsts: Vec<Edge> = by_node.iter().filter_map(|edges| edges.first().copied()).collect();
    firsts.sort_unstable_by_key(Edge::rank);
    let beyond = firsts.split_off(firsts.len().min(limit / 2));
    let seconds = by_node.iter().flat_map(|edges| edges.iter().skip(1).copied());
    let mut others: Vec<Edge> = beyond.into_iter().chain(seconds).collect();
    keep_best(&mut others, limit - firsts.len());
    firsts.extend(others);
    firsts
}

/// Returns the edges of a node to later nodes, best connected first; `edges` is a buffer that holds all of them
/// meanwhile.
fn best_edges(commons: &Commons<'_>, i: usize, edges: &mut Vec<Edge>) -> Vec<Edge> {
    let later = commons.neighbors(i).filter(|&(j, _)| j > i);
    edges.clear();
    edges.extend(later.map(|(j, common)| Edge { common, ends: [i as u32, j as u32] }));
    keep_best(edges, EDGES_PER_NODE);
    edges.clone()
}

/// Keeps the `n` best connected edges, best first.
fn keep_best(edges: &mut Vec<Edge>, n: usize) {
    if 0 < n && n < edges.len() {
        edges.select_nth_unstable_by_key(n, Edge::rank);
    }
    edges.truncate(n);
    edges.sort_unstable_by_key(Edge::rank);
}

/// Returns each pivot with its best connected common neighbours, in the order of the pivots.
fn triangles(commons: &Commons<'_>, pivots: &[Edge]) -> Vec<[u32; 3]> {
    let thirds: Vec<[Third; THIRDS]> = pivots
        .par_iter()
        .with_max_len(PIVOTS_AT_A_TIME)
        .map(|pivot| thirds(pivot.ends.map(|end| commons.row(end as usize))))
        .collect();
    let found = |thirds: [Third; THIRDS]| thirds.into_iter().filter(|third| third.common > 0);
    let of_pivot = |(pivot, thirds): (&Edge, [Third; THIRDS])| {
        let [first, second] = pivot.ends;
        found(thirds).map(move |third| [first, second, third.node])
    };
    pivots.iter().zip(thirds).flat_map(of_pivot).collect()
}

/// A common neighbour of an edge's ends, and how many neighbours it shares with them, summed over both; zero stands for
/// none.
#[derive(Clone, Copy, Default)]
struct Third {
    common: u32,
    node: u32,
}

/// Returns the best connected common neighbours of the ends of an edge; ties go to the first. Compiled for processors
/// that count bits in one instruction, chosen at run time.
#[multiversion(targets("x86_64+avx2+popcnt+bmi1+bmi2", "aarch64+neon"))]
fn thirds([first, second]: [Row<'_>; 2]) -> [Third; THIRDS] {
    let mut best = [Third::default(); THIRDS];
    // The number of neighbours of each end before the current word.
    let (mut before_first, mut before_second) = (0, 0);
    for (word, (&a, &b)) in (0u32..).zip(first.bits.iter().zip(second.bits)) {
        let mut both = a & b;
        while both != 0 {
            let bit = both.trailing_zeros();
            let lower = (1u64 << bit) - 1;
            let with_first = first.counts[before_first + (a & lower).count_ones() as usize];
            let with_second = second.counts[before_second + (b & lower).count_ones() as usize];
            let third = Third { common: with_first + with_second, node: 64 * word + bit };
            if third.common > best[0].common {
                best = [third, best[0]];
            } else if third.common > best[1].common {
                best[1] = third;
            }
            both &= both - 1;
        }
        before_first += a.count_ones() as usize;
        before_second += b.count_ones() as usize;
    }
    best
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
            let pivots = Pivots::new(Cow::Borrowed(&evidence), &Graph::new(&evidence, &RULE), 1000);
            let best = sample(&pivots, &Summed(Mse::new(7.5)), &evidence, 1);
            assert!(angle_between(&best[0].target_from_source, &truth) < 0.01, "seed {seed}");
        }
    }

    #[test]
    fn half_of_the_pivots_are_first_edges_and_the_rest_is_the_best_of_all_others() {
        let (evidence, _) = scene(60, 30, 4);
        let graph = Graph::new(&evidence, &RULE);
        let commons = Commons::new(&graph);
        let by_node: Vec<Vec<Edge>> = (0..graph.len()).map(|i| best_edges(&commons, i, &mut Vec::new())).collect();
        let mut firsts: Vec<u128> = by_node.iter().filter_map(|edges| Some(edges.first()?.rank())).collect();
        firsts.sort_unstable();
        let n_edges = by_node.iter().map(Vec::len).sum::<usize>();
        for limit in [2, firsts.len(), 2 * firsts.len(), n_edges, n_edges + 10] {
            let found: Vec<u128> = pivots(graph.len(), &commons, limit).iter().map(Edge::rank).collect();
            let n_firsts = firsts.len().min(limit / 2);
            assert_eq!(found[..n_firsts], firsts[..n_firsts]);
            let mut others: Vec<u128> = by_node.iter().flatten().map(Edge::rank).collect();
            others.retain(|edge| !firsts[..n_firsts].contains(edge));
            others.sort_unstable();
            others.truncate(limit - n_firsts);
            assert_eq!(found[n_firsts..], others, "{limit} of {n_edges}");
        }
    }

    #[test]
    fn the_limit_holds_and_nothing_proposes_nothing() {
        let (evidence, _) = scene(300, 40, 9);
        assert!(Pivots::new(Cow::Borrowed(&evidence), &Graph::new(&evidence, &RULE), 50).trials() <= 100);
        let none = Evidence::default();
        let pivots = Pivots::new(Cow::Borrowed(&none), &Graph::new(&none, &RULE), 50);
        assert!(pivots.trials() == 0 && pivots.propose(0).is_none());
    }
}
