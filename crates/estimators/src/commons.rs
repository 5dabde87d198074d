//! The number of neighbours that the ends of every edge share, counted once.

use crate::Graph;
use crate::graph::ones;
use rayon::prelude::*;

/// Maximum number of nodes whose edges one thread counts at a time.
const NODES_AT_A_TIME: usize = 32;

/// A count for each edge of a graph, stored at both of its ends, in the order of the rows.
pub(crate) struct Commons<'a> {
    graph: &'a Graph,
    /// Counts for each node.
    counts: Vec<Vec<u32>>,
}

/// The neighbours of a node.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) bits: &'a [u64],
    /// A count for each, ascending by neighbour.
    pub(crate) counts: &'a [u32],
}

impl<'a> Commons<'a> {
    pub(crate) fn new(graph: &'a Graph) -> Self {
        let later = Later::new(graph);
        Commons { graph, counts: of_nodes(graph, |i| later.with_earlier(i)) }
    }

    /// Returns a node's neighbours as bits, and the counts of their edges.
    pub(crate) fn row(&self, i: usize) -> Row<'_> {
        Row { bits: self.graph.row(i), counts: &self.counts[i] }
    }

    /// Returns the neighbours of a node, ascending, with the counts of their edges.
    pub(crate) fn neighbors(&self, i: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let Row { bits, counts } = self.row(i);
        ones(bits).zip(counts.iter().copied())
    }
}

/// The counts of the edges to later nodes.
struct Later<'a> {
    graph: &'a Graph,
    counts: Vec<Vec<u32>>,
    /// For each word of a node's bits the number of neighbours before it, and finally the number of all neighbours.
    before: Vec<Vec<u32>>,
}

impl<'a> Later<'a> {
    fn new(graph: &'a Graph) -> Self {
        let before = of_nodes(graph, |i| before_words(graph.row(i)));
        let counts = of_nodes(graph, |i| {
            let earlier = ones(graph.row(i)).take_while(|&j| j < i).count();
            let mut counts = Vec::with_capacity(graph.degree(i) - earlier);
            counts.extend(ones(graph.row(i)).skip(earlier).map(|j| graph.common(i, j)));
            counts
        });
        Later { graph, counts, before }
    }

    /// Returns the count of the edge from `i` to a later `j`.
    fn of(&self, i: usize, j: usize) -> u32 {
        let (before, counts) = (&self.before[i], &self.counts[i]);
        let in_word = (self.graph.row(i)[j / 64] & ((1 << (j % 64)) - 1)).count_ones();
        let [at, end] = [before[j / 64] + in_word, before[before.len() - 1]].map(|place| place as usize);
        counts[counts.len() - (end - at)]
    }

    /// Returns the counts of all edges of a node.
    fn with_earlier(&self, j: usize) -> Vec<u32> {
        let row = self.graph.row(j);
        let mut counts = Vec::with_capacity(self.graph.degree(j));
        counts.extend(ones(row).take_while(|&i| i < j).map(|i| self.of(i, j)));
        counts.extend_from_slice(&self.counts[j]);
        counts
    }
}

fn before_words(row: &[u64]) -> Vec<u32> {
    let mut before = Vec::with_capacity(row.len() + 1);
    before.push(0);
    before.extend(row.iter().scan(0, |sum, word| {
        *sum += word.count_ones();
        Some(*sum)
    }));
    before
}

fn of_nodes<T: Send>(graph: &Graph, of_node: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..graph.len()).into_par_iter().with_max_len(NODES_AT_A_TIME).map(of_node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};

    #[test]
    fn the_numbers_are_those_of_the_graph() {
        let (evidence, _) = scene(200, 60, 4);
        let graph = Graph::new(&evidence, &RULE);
        let commons = Commons::new(&graph);
        for i in 0..graph.len() {
            let expected: Vec<(usize, u32)> = ones(graph.row(i)).map(|j| (j, graph.common(i, j))).collect();
            assert_eq!(commons.neighbors(i).collect::<Vec<_>>(), expected);
        }
    }
}
