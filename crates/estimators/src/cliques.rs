//! Poses from maximal cliques of the compatibility graph.
//!
//! In a clique all correspondences are compatible with all others. Each node proposes the heaviest of the maximal
//! cliques that contain it, weighted by the neighbours that its edges share (after MAC, Zhang et al. 2023). There may
//! be exponentially many, so the search follows only a limited number of branches from each node, the best connected
//! first.

use crate::graph::{ones, shared};
use crate::pruning::Peeling;
use crate::{Graph, HypothesisGenerator};
use congruent_geometry::{RigidTransform, fit_weighted};
use congruent_metrics::Evidence;
use rayon::prelude::*;
use std::borrow::Cow;

/// Minimum size of a clique; fewer correspondences do not determine a pose.
const MIN_SIZE: usize = 3;
/// Size at which a clique is no longer grown: more correspondences would not make its pose a different one.
const MAX_SIZE: usize = 32;
/// Number of roots whose cliques are held at a time, which bounds the memory.
const ROOTS: usize = 512;

/// Proposes one pose for each of a fixed list of cliques, the heaviest first.
pub struct Cliques<'a> {
    evidence: Cow<'a, Evidence>,
    cliques: Vec<Clique>,
}

/// Nodes, ascending, and the number of shared neighbours summed over all edges between them.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Clique {
    weight: u64,
    nodes: Vec<usize>,
}

impl<'a> Cliques<'a> {
    /// Searches the graph, which must be that of `evidence`; from each node, `branches` branches are followed to their
    /// end.
    #[must_use]
    pub fn new(evidence: Cow<'a, Evidence>, graph: &Graph, branches: usize) -> Self {
        Cliques { evidence, cliques: heaviest(graph, branches) }
    }
}

impl HypothesisGenerator for Cliques<'_> {
    fn trials(&self) -> u64 {
        self.cliques.len() as u64
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let clique = self.cliques.get(usize::try_from(trial).ok()?)?;
        let pair = |&i: &usize| (self.evidence.source(i), self.evidence.target(i), 1.0);
        fit_weighted(clique.nodes.iter().map(pair))
    }
}

/// Returns the heaviest clique found for each node, ties going to the earlier root; each clique once.
fn heaviest(graph: &Graph, branches: usize) -> Vec<Clique> {
    let order = Peeling::of(graph).order;
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, &node)| place[node] = at);
    let strength: Vec<u64> = (0..graph.len()).into_par_iter().map(|i| strength(graph, i)).collect();

    let mut best: Vec<Option<std::sync::Arc<Clique>>> = vec![None; graph.len()];
    for roots in order.chunks(ROOTS) {
        let search = |&root: &usize| Search::from(root, graph, &place, &strength, branches);
        let found: Vec<Vec<Clique>> = roots.par_iter().map(search).collect();
        for clique in found.into_iter().flatten().map(std::sync::Arc::new) {
            for &node in &clique.nodes {
                if best[node].as_ref().is_none_or(|other| clique.weight > other.weight) {
                    best[node] = Some(clique.clone());
                }
            }
        }
    }
    let mut cliques: Vec<Clique> = best.into_iter().flatten().map(|clique| (*clique).clone()).collect();
    cliques.sort_by(|a, b| b.weight.cmp(&a.weight).then_with(|| a.nodes.cmp(&b.nodes)));
    cliques.dedup();
    cliques
}

/// Returns the number of shared neighbours summed over all edges of a node.
fn strength(graph: &Graph, i: usize) -> u64 {
    ones(graph.row(i)).map(|j| u64::from(graph.common(i, j))).sum()
}

/// Bron–Kerbosch search with pivoting, from one root.
struct Search<'g> {
    graph: &'g Graph,
    strength: &'g [u64],
    branches_left: usize,
    clique: Vec<usize>,
    found: Vec<Clique>,
}

impl<'g> Search<'g> {
    /// Returns the cliques whose first node by `place` is the root.
    fn from(root: usize, graph: &'g Graph, place: &[usize], strength: &'g [u64], branches: usize) -> Vec<Clique> {
        let (mut later, mut earlier) = (graph.row(root).to_vec(), graph.row(root).to_vec());
        for neighbor in ones(graph.row(root)) {
            let wrong = if place[neighbor] > place[root] { &mut earlier } else { &mut later };
            wrong[neighbor / 64] &= !(1 << (neighbor % 64));
        }
        let mut search = Search { graph, strength, branches_left: branches, clique: vec![root], found: Vec::new() };
        search.extend(0, later, earlier);
        search.found
    }

    /// Grows the clique by `candidates`, neighbours of all its nodes; together with `done` these are all such
    /// neighbours.
    fn extend(&mut self, weight: u64, mut candidates: Vec<u64>, mut done: Vec<u64>) {
        let grown = self.clique.len() == MAX_SIZE || is_empty(&candidates);
        if grown {
            self.branches_left = self.branches_left.saturating_sub(1);
            if self.clique.len() >= MIN_SIZE && (self.clique.len() == MAX_SIZE || is_empty(&done)) {
                let mut nodes = self.clique.clone();
                nodes.sort_unstable();
                self.found.push(Clique { weight, nodes });
            }
            return;
        }
        for node in self.branching(&candidates, &done) {
            if self.branches_left == 0 {
                return;
            }
            let more: u64 = self.clique.iter().map(|&i| u64::from(self.graph.common(i, node))).sum();
            self.clique.push(node);
            self.extend(weight + more, both(&candidates, self.graph.row(node)), both(&done, self.graph.row(node)));
            self.clique.pop();
            candidates[node / 64] &= !(1 << (node % 64));
            done[node / 64] |= 1 << (node % 64);
        }
    }

    /// Returns the candidates that are not neighbours of the pivot, which is the node with most neighbours among the
    /// candidates; the strongest first.
    fn branching(&self, candidates: &[u64], done: &[u64]) -> Vec<usize> {
        let known = |i: usize| shared(candidates, self.graph.row(i));
        let pivot = ones(candidates).chain(ones(done)).max_by_key(|&i| (known(i), std::cmp::Reverse(i)));
        let mut nodes: Vec<usize> = match pivot {
            Some(pivot) => {
                let strangers: Vec<u64> =
                    candidates.iter().zip(self.graph.row(pivot)).map(|(all, known)| all & !known).collect();
                ones(&strangers).collect()
            }
            None => Vec::new(),
        };
        nodes.sort_by_key(|&i| (std::cmp::Reverse(self.strength[i]), i));
        nodes
    }
}

fn both(a: &[u64], b: &[u64]) -> Vec<u64> {
    a.iter().zip(b).map(|(a, b)| a & b).collect()
}

fn is_empty(words: &[u64]) -> bool {
    words.iter().all(|&word| word == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};
    use crate::sample;
    use congruent_geometry::angle_between;
    use congruent_metrics::{Mse, Summed};

    const BRANCHES: usize = 10;

    #[test]
    fn two_right_in_a_hundred_are_enough() {
        for seed in 0..5 {
            let (evidence, truth) = scene(1000, 20, seed);
            let cliques = Cliques::new(Cow::Borrowed(&evidence), &Graph::new(&evidence, &RULE), BRANCHES);
            let best = sample(&cliques, &Summed(Mse::new(7.5)), &evidence, 1);
            assert!(angle_between(&best[0].target_from_source, &truth) < 0.01, "seed {seed}");
        }
    }

    /// All maximal cliques of three or more nodes, by exhaustive search.
    fn all_maximal(graph: &Graph) -> Vec<Vec<usize>> {
        let n = graph.len();
        let neighbors: Vec<u32> = (0..n).map(|i| graph.row(i)[0] as u32).collect();
        let nodes = |set: u32| (0..n).filter(move |&i| set >> i & 1 == 1);
        let shared = |set: u32| nodes(set).fold(u32::MAX >> (32 - n), |shared, i| shared & neighbors[i]);
        let is_clique = |set: u32| nodes(set).all(|i| set & !(1 << i) & !neighbors[i] == 0);
        let maximal = (1u32..1 << n).filter(|&set| set.count_ones() >= 3 && is_clique(set) && shared(set) == 0);
        maximal.map(|set| nodes(set).collect()).collect()
    }

    #[test]
    fn each_node_has_the_heaviest_of_all_maximal_cliques() {
        for seed in 0..20 {
            let (evidence, _) = scene(14, 9, seed);
            let graph = Graph::new(&evidence, &crate::Compatibility { tolerance: 40.0, max_cosine: 2.0, ..RULE });
            let weight = |nodes: &[usize]| -> u64 {
                let edges = nodes.iter().flat_map(|&i| nodes.iter().filter(move |&&j| j > i).map(move |&j| (i, j)));
                edges.map(|(i, j)| u64::from(graph.common(i, j))).sum()
            };
            let (all, found) = (all_maximal(&graph), heaviest(&graph, usize::MAX));
            assert!(found.iter().all(|clique| all.contains(&clique.nodes) && clique.weight == weight(&clique.nodes)));
            for node in 0..14 {
                let expected = all.iter().filter(|nodes| nodes.contains(&node)).map(|nodes| weight(nodes)).max();
                let best = found.iter().filter(|clique| clique.nodes.contains(&node)).map(|c| c.weight).max();
                assert_eq!(best, expected, "seed {seed}, node {node}");
            }
        }
    }

    #[test]
    fn cliques_keep_to_their_size_and_the_search_to_its_branches() {
        // All 300 are right: one clique, except for close pairs.
        let (evidence, _) = scene(300, 300, 3);
        let cliques = heaviest(&Graph::new(&evidence, &RULE), 1);
        assert!(!cliques.is_empty() && cliques.len() <= 300);
        assert!(cliques.iter().all(|clique| (MIN_SIZE..=MAX_SIZE).contains(&clique.nodes.len())));
    }

    #[test]
    fn nothing_proposes_nothing() {
        let none = Evidence::default();
        let cliques = Cliques::new(Cow::Borrowed(&none), &Graph::new(&none, &RULE), BRANCHES);
        assert!(cliques.trials() == 0 && cliques.propose(0).is_none());
    }
}
