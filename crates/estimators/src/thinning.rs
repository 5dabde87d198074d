//! Limits the correspondences to what a compatibility graph can handle.
//!
//! Right correspondences are all compatible with each other, so the number of edges grows with the square of their
//! number, and the work on shared neighbours with the cube; far fewer than all of them show the pose as well.

use crate::{Compatibility, Graph};
use congruent_metrics::Evidence;
use std::borrow::Cow;

/// This many correspondences are never too many: if all are compatible, they have some eight million edges …
const ALWAYS: usize = 4000;
/// … and larger sets are thinned to about as many.
const MOST_EDGES: f64 = 8e6;
/// Number of correspondences among which edges are counted first.
const PROBED: usize = 2000;

/// Returns all correspondences, or an evenly spread part of them if their graph would have more than some eight million
/// edges.
pub(crate) fn of_few_edges<'a>(evidence: &'a Evidence, rule: &Compatibility) -> Cow<'a, Evidence> {
    let n = evidence.len();
    if n <= ALWAYS {
        return Cow::Borrowed(evidence);
    }
    let probe = Graph::new(&evidence.chosen(&evenly(n, PROBED)), rule);
    let ends: usize = (0..PROBED).map(|i| probe.degree(i)).sum();
    let share = ends as f64 / (PROBED * (PROBED - 1)) as f64;
    let bearable = (2.0 * MOST_EDGES / share).sqrt();
    if bearable >= n as f64 {
        return Cow::Borrowed(evidence);
    }
    Cow::Owned(evidence.chosen(&evenly(n, ALWAYS.max(bearable as usize))))
}

/// Returns `count` of `n` positions, evenly spread, since the order may be one of quality or of position.
fn evenly(n: usize, count: usize) -> Vec<usize> {
    (0..count).map(|i| i * n / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::tests::{RULE, scene};

    #[test]
    fn only_a_dense_graph_is_thinned() {
        let kept = |n, right| of_few_edges(&scene(n, right, 1).0, &RULE).len();
        assert_eq!(kept(4000, 4000), 4000);
        assert_eq!(kept(6000, 600), 6000);
        let dense = kept(9000, 9000);
        assert!((4000..4400).contains(&dense), "{dense}");
        let half = kept(12_000, 6000);
        assert!((6000..9000).contains(&half), "{half}");
    }
}
