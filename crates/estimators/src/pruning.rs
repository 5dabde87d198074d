//! Pruning of the compatibility graph to its innermost core.
//!
//! The k-core is what remains when nodes with fewer than k neighbours are removed repeatedly. Right correspondences are
//! all joined to each other, so they stay to the end; most wrong ones go early (ROBIN, Shi et al. 2021; KISS-Matcher,
//! Lim et al. 2024). A repetitive scene can have a wrong innermost core.

use crate::Graph;
use crate::graph::ones;
use serde::{Deserialize, Serialize};

/// Minimum number of nodes in a meaningful core.
const MIN_NODES: usize = 5;
/// Minimum core number that is meaningful: chance alone produces smaller ones.
const MIN_NUMBER: usize = 3;

/// What is removed from the compatibility graph before it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pruning {
    /// Nothing.
    #[default]
    None,
    /// All edges outside the innermost core, if that has at least five nodes and core number 3.
    Core,
}

impl Graph {
    /// Returns the same nodes with the edges that remain after pruning.
    #[must_use]
    pub fn pruned(self, pruning: Pruning) -> Graph {
        match pruning {
            Pruning::None => self,
            Pruning::Core => innermost(self),
        }
    }
}

fn innermost(graph: Graph) -> Graph {
    let numbers = Peeling::of(&graph).numbers;
    let largest = numbers.iter().copied().max().unwrap_or(0);
    let n_nodes = numbers.iter().filter(|&&number| number == largest).count();
    if n_nodes < MIN_NODES || largest < MIN_NUMBER {
        return graph;
    }
    graph.filtered(|i, j| numbers[i] == largest && numbers[j] == largest)
}

/// The order in which nodes go when one with the fewest neighbours is removed at a time.
pub(crate) struct Peeling {
    /// The largest k for which each node is in the k-core.
    pub(crate) numbers: Vec<usize>,
    /// All nodes, the first to go first: a degeneracy order.
    pub(crate) order: Vec<usize>,
}

impl Peeling {
    /// Computes the order with bins of equal degree (Batagelj and Zaveršnik 2003), in time linear in the edges.
    pub(crate) fn of(graph: &Graph) -> Peeling {
        let mut bins = Bins::new((0..graph.len()).map(|i| graph.degree(i)).collect());
        for at in 0..graph.len() {
            let gone = bins.order[at];
            for neighbor in ones(graph.row(gone)) {
                if bins.degrees[neighbor] > bins.degrees[gone] {
                    bins.lower(neighbor);
                }
            }
        }
        Peeling { numbers: bins.degrees, order: bins.order }
    }
}

/// Nodes sorted by degree; a degree can be lowered by one in constant time.
struct Bins {
    degrees: Vec<usize>,
    order: Vec<usize>,
    /// Position of each node in `order`.
    places: Vec<usize>,
    /// Position in `order` of the first node of each degree.
    starts: Vec<usize>,
}

impl Bins {
    fn new(degrees: Vec<usize>) -> Bins {
        let mut order: Vec<usize> = (0..degrees.len()).collect();
        order.sort_by_key(|&i| degrees[i]);
        let mut places = vec![0; order.len()];
        for (place, &i) in order.iter().enumerate() {
            places[i] = place;
        }
        let largest = order.last().map_or(0, |&i| degrees[i]);
        let starts = (0..=largest).map(|degree| order.partition_point(|&i| degrees[i] < degree)).collect();
        Bins { degrees, order, places, starts }
    }

    /// Lowers a degree by swapping the node with the first of its degree and moving the border behind it.
    fn lower(&mut self, node: usize) {
        let (place, first) = (self.places[node], self.starts[self.degrees[node]]);
        let other = self.order[first];
        self.order.swap(place, first);
        (self.places[node], self.places[other]) = (first, place);
        self.starts[self.degrees[node]] += 1;
        self.degrees[node] -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};
    use congruent_metrics::Evidence;

    /// Random graphs from empty to nearly complete: some of the edges of a complete graph.
    fn random(n: usize, seed: u64) -> Graph {
        let mut stream = congruent_geometry::random::Stream::new(seed, 0);
        let point = |i: usize| [i as f32, 0.0, 0.0];
        let all = Graph::new(
            &Evidence::new((0..n).map(|i| (point(i), point(i)))),
            &crate::Compatibility { tolerance: 1.0, min_distance: 0.5, ..RULE },
        );
        let density = stream.between(0.0, 1.0);
        let coins: Vec<bool> = (0..n * n).map(|_| stream.between(0.0, 1.0) < density).collect();
        all.filtered(|i, j| coins[i * n + j])
    }

    /// Removes whatever has fewer than k neighbours until nothing changes, for each k from the start.
    fn naive(graph: &Graph) -> Vec<usize> {
        let mut numbers = vec![0; graph.len()];
        for k in 1..graph.len() {
            let mut left = vec![true; graph.len()];
            let poor = |left: &[bool]| {
                (0..left.len()).find(|&i| left[i] && ones(graph.row(i)).filter(|&j| left[j]).count() < k)
            };
            while let Some(i) = poor(&left) {
                left[i] = false;
            }
            (0..left.len()).filter(|&i| left[i]).for_each(|i| numbers[i] = k);
        }
        numbers
    }

    #[test]
    fn core_numbers_are_those_of_naive_peeling() {
        for seed in 0..60 {
            let graph = random(seed as usize % 40, seed);
            assert_eq!(Peeling::of(&graph).numbers, naive(&graph), "seed {seed}");
        }
    }

    #[test]
    fn no_node_has_more_later_neighbours_than_its_core_number() {
        for seed in 0..20 {
            let graph = random(70, seed);
            let Peeling { numbers, order } = Peeling::of(&graph);
            let mut gone = [false; 70];
            for &i in &order {
                gone[i] = true;
                assert!(ones(graph.row(i)).filter(|&j| !gone[j]).count() <= numbers[i]);
            }
            assert!(gone.iter().all(|&gone| gone));
        }
    }

    #[test]
    fn right_correspondences_are_the_core() {
        let (evidence, _) = scene(500, 30, 4);
        let graph = Graph::new(&evidence, &RULE).pruned(Pruning::Core);
        let kept: Vec<usize> = (0..500).filter(|&i| graph.degree(i) > 0).collect();
        assert!(kept.len() >= 20 && kept.iter().all(|&i| i < 30), "{kept:?}");
    }

    #[test]
    fn a_core_that_says_nothing_is_not_cut_out() {
        // A path, and a square with its diagonals: 4 nodes of core number 3.
        let edges = [(0, 1), (1, 2), (2, 3), (3, 4), (5, 6), (5, 7), (5, 8), (6, 7), (6, 8), (7, 8)];
        let point = |i: usize| [i as f32, 0.0, 0.0];
        let rule = crate::Compatibility { tolerance: 1.0, min_distance: 0.5, ..RULE };
        let all = Graph::new(&Evidence::new((0..9).map(|i| (point(i), point(i)))), &rule);
        let few = all.filtered(|i, j| edges.contains(&(i, j)));
        assert_eq!(Peeling::of(&few).numbers, [1, 1, 1, 1, 1, 3, 3, 3, 3]);
        assert_eq!(few.pruned(Pruning::Core).degree(0), 1);
        // With one more node the core is large enough to be cut out.
        let more = all.filtered(|i, j| edges.contains(&(i, j)) || (i >= 4 && j > 4));
        assert_eq!(more.pruned(Pruning::Core).degree(0), 0);
        assert!(Graph::new(&Evidence::default(), &RULE).pruned(Pruning::Core).is_empty());
    }
}
