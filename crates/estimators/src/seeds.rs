//! Poses from groups of correspondences around reliable ones.
//!
//! SC²-PCR (Chen et al. 2022): the leading eigenvector of the compatibility matrix tells how reliable each
//! correspondence is; the most reliable ones, spread over the scan, are the seeds. Each gathers, in two steps, the
//! correspondences with which it shares most neighbours, and the group is fitted with the leading eigenvector of its
//! own matrix as weights.

use crate::graph::ones;
use crate::{Graph, HypothesisGenerator};
use congruent_geometry::{RigidTransform, fit_weighted};
use congruent_metrics::Evidence;
use rayon::prelude::*;
use std::borrow::Cow;

/// Number of power iterations; the value of the authors' code.
const POWER_ITERATIONS: usize = 10;
/// Shared neighbours are counted in a graph with this fraction of the tolerance.
const TIGHT: f64 = 0.5;

/// How seeds are chosen and what they gather; lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeedRule {
    /// Tolerance of the graph: the weight of an edge falls to zero at this difference of lengths.
    pub tolerance: f64,
    /// Distance that the source points of two seeds must exceed.
    pub separation: f64,
    /// Maximum number of seeds as a fraction of the correspondences.
    pub share: f64,
    /// Number of correspondences that a seed gathers first, itself included.
    pub gathered: usize,
    /// Number of those that are kept for the fit, the seed included.
    pub kept: usize,
}

/// Proposes one pose per seed.
pub struct Seeds<'a> {
    evidence: Cow<'a, Evidence>,
    graph: Graph,
    tight: Graph,
    seeds: Vec<usize>,
    rule: SeedRule,
}

impl<'a> Seeds<'a> {
    /// Chooses the seeds in the graph, which must be that of `evidence`.
    #[must_use]
    pub fn new(evidence: Cow<'a, Evidence>, graph: Graph, rule: SeedRule) -> Self {
        let tight = graph.filtered(|i, j| difference(&evidence, i, j) <= TIGHT * rule.tolerance);
        let seeds = seeds(&evidence, &reliability(&evidence, &graph, rule.tolerance), &rule);
        Seeds { evidence, graph, tight, seeds, rule }
    }

    /// Returns the seed and the neighbours with which it shares most neighbours.
    fn gathered(&self, seed: usize) -> Vec<usize> {
        let shared = ones(self.graph.row(seed)).map(|j| (self.tight.common(seed, j), j)).collect();
        with_best(seed, shared, self.rule.gathered)
    }

    /// Selects from the gathered ones in the same way, counting only neighbours that were gathered, too.
    fn kept(&self, gathered: &[usize]) -> Vec<usize> {
        let seed = gathered[0];
        let joined = |i: usize, j: usize| self.graph.row(i)[j / 64] >> (j % 64) & 1 == 1;
        let shared = |j: usize| gathered[1..].iter().filter(|&&k| joined(j, k)).count() as u32;
        with_best(seed, gathered[1..].iter().map(|&j| (shared(j), j)).collect(), self.rule.kept)
    }

    fn fitted(&self, group: &[usize]) -> Option<RigidTransform> {
        let weight = |i: usize, j: usize| if i == j { 0.0 } else { weight(&self.evidence, i, j, self.rule.tolerance) };
        let times = |v: &[f64]| -> Vec<f64> {
            group.iter().map(|&i| group.iter().zip(v).map(|(&j, v)| weight(i, j) * v).sum()).collect()
        };
        let weights = leading_eigenvector(group.len(), times);
        fit_weighted(group.iter().zip(weights).map(|(&i, w)| (self.evidence.source(i), self.evidence.target(i), w)))
    }
}

impl HypothesisGenerator for Seeds<'_> {
    fn trials(&self) -> u64 {
        self.seeds.len() as u64
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let seed = *self.seeds.get(usize::try_from(trial).ok()?)?;
        self.fitted(&self.kept(&self.gathered(seed)))
    }
}

/// Returns the seed first, then the others with the highest counts, ties going to the earlier; `n` in all.
fn with_best(seed: usize, mut others: Vec<(u32, usize)>, n: usize) -> Vec<usize> {
    others.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    std::iter::once(seed).chain(others.into_iter().map(|(_, j)| j)).take(n.max(1)).collect()
}

/// Returns the difference between the distances of two correspondences in source and target.
fn difference(evidence: &Evidence, i: usize, j: usize) -> f64 {
    let in_source = (evidence.source(i) - evidence.source(j)).norm();
    let in_target = (evidence.target(i) - evidence.target(j)).norm();
    (in_source - in_target).abs()
}

/// Returns how compatible two correspondences are, 0 to 1.
fn weight(evidence: &Evidence, i: usize, j: usize, tolerance: f64) -> f64 {
    let u = difference(evidence, i, j) / tolerance;
    (1.0 - u * u).max(0.0)
}

/// Returns the leading eigenvector of the weighted graph.
fn reliability(evidence: &Evidence, graph: &Graph, tolerance: f64) -> Vec<f64> {
    let weights = |i: usize| ones(graph.row(i)).map(|j| weight(evidence, i, j, tolerance) as f32).collect();
    let rows: Vec<Vec<f32>> = (0..graph.len()).into_par_iter().map(weights).collect();
    let row_times = |i: usize, v: &[f64]| ones(graph.row(i)).zip(&rows[i]).map(|(j, &w)| f64::from(w) * v[j]).sum();
    leading_eigenvector(graph.len(), |v| (0..graph.len()).into_par_iter().map(|i| row_times(i, v)).collect())
}

/// Returns the leading eigenvector of a matrix without negative entries, by power iterations; zeros if the matrix is
/// zero.
fn leading_eigenvector(n: usize, times: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut vector = vec![1.0; n];
    for _ in 0..POWER_ITERATIONS {
        vector = times(&vector);
        let norm = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        if norm > 0.0 {
            vector.iter_mut().for_each(|v| *v /= norm);
        }
    }
    vector
}

/// Returns the most reliable correspondences first, each separated from those before it.
fn seeds(evidence: &Evidence, reliability: &[f64], rule: &SeedRule) -> Vec<usize> {
    let limit = (rule.share.clamp(0.0, 1.0) * reliability.len() as f64).ceil() as usize;
    let mut ranked: Vec<usize> = (0..reliability.len()).filter(|&i| reliability[i] > 0.0).collect();
    ranked.sort_by(|&a, &b| reliability[b].total_cmp(&reliability[a]));
    let mut taken: Vec<usize> = Vec::new();
    for i in ranked {
        if taken.len() == limit {
            break;
        }
        let point = evidence.source(i);
        if taken.iter().all(|&other| (evidence.source(other) - point).norm() > rule.separation) {
            taken.push(i);
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};
    use crate::sample;
    use congruent_geometry::angle_between;
    use congruent_metrics::{Mse, Summed};

    const SEEDS: SeedRule = SeedRule { tolerance: 4.0, separation: 4.0, share: 0.2, gathered: 30, kept: 20 };

    fn generator(evidence: &Evidence, rule: SeedRule) -> Seeds<'_> {
        Seeds::new(Cow::Borrowed(evidence), Graph::new(evidence, &RULE), rule)
    }

    #[test]
    fn two_right_in_a_hundred_are_enough() {
        for seed in 0..5 {
            let (evidence, truth) = scene(1000, 20, seed);
            let best = sample(&generator(&evidence, SEEDS), &Summed(Mse::new(7.5)), &evidence, 1);
            assert!(angle_between(&best[0].target_from_source, &truth) < 0.01, "seed {seed}");
        }
    }

    #[test]
    fn right_correspondences_are_the_most_reliable_seeds_and_gather_right_ones() {
        let (evidence, _) = scene(300, 40, 9);
        let generator = generator(&evidence, SEEDS);
        assert!(generator.seeds[..30].iter().all(|&seed| seed < 40), "{:?}", generator.seeds);
        let group = generator.kept(&generator.gathered(generator.seeds[0]));
        assert!(group.len() == 20 && group.iter().all(|&i| i < 40), "{group:?}");
    }

    #[test]
    fn seeds_keep_their_number_and_their_distance() {
        let (evidence, _) = scene(300, 40, 9);
        let seeds = generator(&evidence, SeedRule { separation: 40.0, ..SEEDS }).seeds;
        assert!(seeds.len() > 5 && generator(&evidence, SEEDS).seeds.len() <= 60);
        for (at, &i) in seeds.iter().enumerate() {
            assert!(seeds[..at].iter().all(|&j| (evidence.source(i) - evidence.source(j)).norm() > 40.0));
        }
    }

    #[test]
    fn the_leading_eigenvector_of_a_known_matrix_is_found() {
        // Eigenvalues 3 and 1.
        let v = leading_eigenvector(2, |v| vec![2.0 * v[0] + v[1], v[0] + 2.0 * v[1]]);
        assert!((v[0] - 0.5f64.sqrt()).abs() < 1e-12 && (v[0] - v[1]).abs() < 1e-12);
        // A star of three leaves and an isolated node: the hub has √3 times the weight of a leaf, but in a bipartite
        // graph the iteration does not converge; a loop at each node makes it converge.
        let star = |v: &[f64]| vec![v[0] + v[1] + v[2] + v[3], v[0] + v[1], v[0] + v[2], v[0] + v[3], 0.0];
        let v = leading_eigenvector(5, star);
        assert!((v[0] / v[1] - 3f64.sqrt()).abs() < 1e-4 && v[4] == 0.0, "{v:?}");
    }

    #[test]
    fn nothing_proposes_nothing() {
        let none = Evidence::default();
        assert!(generator(&none, SEEDS).trials() == 0 && generator(&none, SEEDS).propose(0).is_none());
        let same = Evidence::new((0..50).map(|_| ([1.0; 3], [2.0; 3])));
        assert_eq!(generator(&same, SEEDS).trials(), 0);
    }
}
