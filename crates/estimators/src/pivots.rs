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
        let triangles = pivots.par_iter().flat_map_iter(|edge| triangles(&commons, edge)).collect();
        Pivots { evidence, triangles }
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
    rank(&mut firsts);
    firsts.truncate(limit / 2);
    let mut others: Vec<Edge> = by_node.iter().flat_map(|edges| edges.iter().skip(1).copied()).collect();
    rank(&mut others);
    others.truncate(limit - firsts.len());
    firsts.extend(others);
    firsts
}

/// The edges of a node to later nodes, best connected first.
fn best_edges(commons: &Commons<'_>, i: usize) -> Vec<Edge> {
    let mut edges: Vec<Edge> =
        commons.later(i).map(|(j, common)| Edge { common, ends: [i as u32, j as u32] }).collect();
    rank(&mut edges);
    edges.truncate(EDGES_PER_NODE);
    edges
}

fn rank(edges: &mut [Edge]) {
    edges.sort_unstable_by(|a, b| b.common.cmp(&a.common).then(a.ends.cmp(&b.ends)));
}

/// The pivot with each of its best connected common neighbours; of equals the first.
fn triangles(commons: &Commons<'_>, edge: &Edge) -> Vec<[u32; 3]> {
    let [i, j] = edge.ends;
    let mut best: Vec<(u32, usize)> = Vec::with_capacity(THIRDS + 1);
    commons.each_shared(i as usize, j as usize, |k, [with_i, with_j]| {
        let common = with_i + with_j;
        let place = best.partition_point(|other| other.0 >= common);
        if place < THIRDS {
            best.insert(place, (common, k));
            best.truncate(THIRDS);
        }
    });
    best.iter().map(|&(_, k)| [i, j, k as u32]).collect()
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
