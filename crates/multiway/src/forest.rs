//! Spanning trees of the strongest edges: initial poses and connected components.

use crate::Edge;
use congruent_geometry::RigidTransform;
use std::collections::VecDeque;

/// Disjoint sets of scans.
pub(crate) struct Sets(Vec<usize>);

impl Sets {
    pub(crate) fn new(n: usize) -> Sets {
        Sets((0..n).collect())
    }

    pub(crate) fn root(&mut self, mut node: usize) -> usize {
        while self.0[node] != node {
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    /// Joins two sets, and returns whether they were separate.
    pub(crate) fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }
}

/// Returns the scans connected by edges, each list ascending, the lists ordered by their first scan.
pub(crate) fn components(n: usize, ends: impl Iterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    let mut sets = Sets::new(n);
    ends.for_each(|(a, b)| {
        sets.join(a, b);
    });
    let mut lists: Vec<Vec<usize>> = vec![Vec::new(); n];
    (0..n).for_each(|node| lists[sets.root(node)].push(node));
    lists.retain(|list| !list.is_empty());
    lists
}

/// Returns poses along the maximum spanning tree (Kruskal), breadth first from `root`; ties go to the earlier edge.
/// Scans that the edges do not reach have the identity.
pub(crate) fn spanned(n: usize, edges: &[Edge], strengths: &[f64], root: usize) -> Vec<RigidTransform> {
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by(|&a, &b| strengths[b].total_cmp(&strengths[a]).then(a.cmp(&b)));
    let mut sets = Sets::new(n);
    let mut neighbors: Vec<Vec<(usize, RigidTransform)>> = vec![Vec::new(); n];
    for edge in order.into_iter().map(|at| &edges[at]) {
        if sets.join(edge.source, edge.target) {
            neighbors[edge.target].push((edge.source, edge.target_from_source));
            neighbors[edge.source].push((edge.target, edge.target_from_source.inverse()));
        }
    }
    let mut poses = vec![RigidTransform::identity(); n];
    let mut reached = vec![false; n];
    let mut queue: VecDeque<usize> = (root < n).then_some(root).into_iter().collect();
    while let Some(node) = queue.pop_front() {
        reached[node] = true;
        for (next, node_from_next) in &neighbors[node] {
            if !reached[*next] {
                poses[*next] = poses[node] * node_from_next;
                queue.push_back(*next);
            }
        }
    }
    poses
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    #[test]
    fn components_are_what_hangs_together() {
        let found = components(6, [(4, 1), (5, 0), (1, 2)].into_iter());
        assert_eq!(found, [vec![0, 5], vec![1, 2, 4], vec![3]]);
        assert!(components(0, std::iter::empty()).is_empty());
    }

    #[test]
    fn the_stronger_way_is_taken() {
        let edge = |source, target, shift| Edge {
            source,
            target,
            target_from_source: RigidTransform::translation(shift, 0.0, 0.0),
            information: Matrix6::identity(),
        };
        let edges = [edge(0, 1, 1.0), edge(1, 2, 1.0), edge(2, 0, 7.0)];
        let place = |strengths: &[f64]| spanned(3, &edges, strengths, 0)[2].translation.vector.x;
        assert_eq!(place(&[0.5, 0.5, 0.1]), -2.0);
        assert_eq!(place(&[0.5, 0.1, 0.2]), 7.0);
    }
}
