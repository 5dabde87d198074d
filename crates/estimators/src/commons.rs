//! How many neighbours the ends of every edge share, counted once.

use crate::Graph;
use crate::graph::ones;
use rayon::prelude::*;

/// Nodes whose edges one thread counts at a time, at most.
const NODES_AT_A_TIME: usize = 32;

/// A number for each edge of a graph, from both of its ends, in the order of the rows.
pub(crate) struct Commons<'a> {
    graph: &'a Graph,
    /// For each node where its numbers begin, and the end at last.
    starts: Vec<usize>,
    counts: Vec<u32>,
}

/// The neighbours of a node.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) bits: &'a [u64],
    /// A number for each, ascending.
    pub(crate) counts: &'a [u32],
}

impl<'a> Commons<'a> {
    pub(crate) fn new(graph: &'a Graph) -> Self {
        let n = graph.len();
        let mut starts = vec![0; n + 1];
        (0..n).for_each(|i| starts[i + 1] = starts[i] + graph.degree(i));
        let later = |i: usize| ones(graph.row(i)).filter(move |&j| j > i).map(move |j| graph.common(i, j)).collect();
        let later: Vec<Vec<u32>> = (0..n).into_par_iter().with_max_len(NODES_AT_A_TIME).map(later).collect();
        let mut counts = vec![0; starts[n]];
        // Rows are filled in ascending order, so a row's numbers for earlier nodes come in their order.
        let mut filled = starts.clone();
        for (i, later) in later.iter().enumerate() {
            let end = starts[i + 1];
            counts[end - later.len()..end].copy_from_slice(later);
            for (j, &count) in ones(graph.row(i)).filter(|&j| j > i).zip(later) {
                counts[filled[j]] = count;
                filled[j] += 1;
            }
        }
        Commons { graph, starts, counts }
    }

    /// A node's neighbours as bits, and the numbers of their edges.
    pub(crate) fn row(&self, i: usize) -> Row<'_> {
        Row { bits: self.graph.row(i), counts: &self.counts[self.starts[i]..self.starts[i + 1]] }
    }

    /// The neighbours of a node, ascending, with the numbers of their edges.
    pub(crate) fn neighbors(&self, i: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let Row { bits, counts } = self.row(i);
        ones(bits).zip(counts.iter().copied())
    }
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
