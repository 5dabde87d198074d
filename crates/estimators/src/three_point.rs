//! Plain RANSAC: three random correspondences determine a pose.

use crate::prosac::{Order, Triples};
use crate::{AdaptiveStop, Drawn, HypothesisGenerator};
use congruent_geometry::random::Stream;
use congruent_geometry::{RigidTransform, fit_three};
use congruent_metrics::Evidence;
use nalgebra::Vector3;

/// Maximum number of draws per trial: unusable samples are drawn again and do not count as trials.
const MAX_REDRAWS: u64 = 100;

/// Which samples are usable, and the order in which they are drawn. The default accepts all in any order, as in the
/// paper.
#[derive(Clone, Debug, Default)]
pub struct TripleRule {
    /// Minimum ratio of the shorter of two corresponding edges to the longer; zero accepts all.
    pub min_edge_ratio: f64,
    /// Length that edges in the source must exceed, data units; zero accepts all.
    pub min_spread: f64,
    /// The order of drawing.
    pub order: Order,
    /// When to stop before all trials are done.
    pub stop: Option<AdaptiveStop>,
}

impl TripleRule {
    fn accepts(&self, source: &[Vector3<f64>; 3], target: &[Vector3<f64>; 3]) -> bool {
        [(0, 1), (1, 2), (2, 0)].iter().all(|&(a, b)| {
            let (in_source, in_target) = ((source[a] - source[b]).norm(), (target[a] - target[b]).norm());
            in_source > self.min_spread && in_source.min(in_target) >= self.min_edge_ratio * in_source.max(in_target)
        })
    }
}

/// Poses from three different correspondences each (Fischler and Bolles 1981).
///
/// Three that share a point, that lie on a line in either cloud, or that violate the rule, are drawn again.
pub struct ThreePoint<'a> {
    evidence: &'a Evidence,
    rule: TripleRule,
    /// `None` for fewer than three pairs.
    triples: Option<Triples>,
    trials: u64,
    seed: u64,
}

impl<'a> ThreePoint<'a> {
    /// Draws uniformly from `evidence`; fewer than three pairs propose nothing.
    #[must_use]
    pub fn new(evidence: &'a Evidence, trials: u64, seed: u64) -> Self {
        ThreePoint::with_rule(evidence, TripleRule::default(), trials, seed)
    }

    /// Draws from `evidence` under a rule; fewer than three pairs propose nothing.
    #[must_use]
    pub fn with_rule(evidence: &'a Evidence, rule: TripleRule, trials: u64, seed: u64) -> Self {
        let n = u32::try_from(evidence.len()).ok().filter(|&n| n >= 3);
        let triples = n.map(|n| Triples::new(n, rule.order));
        ThreePoint { evidence, rule, triples, trials, seed }
    }

    fn fit(&self, sample: [u32; 3]) -> Option<RigidTransform> {
        let source = sample.map(|i| self.evidence.source(i as usize));
        let target = sample.map(|i| self.evidence.target(i as usize));
        if self.rule.accepts(&source, &target) { fit_three(&source, &target) } else { None }
    }
}

impl HypothesisGenerator for ThreePoint<'_> {
    fn trials(&self) -> u64 {
        self.trials
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        self.draw(trial).pose
    }

    fn draw(&self, trial: u64) -> Drawn {
        let Some(triples) = &self.triples else { return Drawn { pose: None, samples: 0 } };
        let mut stream = Stream::new(self.seed, trial);
        (1..=MAX_REDRAWS)
            .find_map(|samples| {
                self.fit(triples.draw(trial, &mut stream)).map(|pose| Drawn { pose: Some(pose), samples })
            })
            .unwrap_or(Drawn { pose: None, samples: MAX_REDRAWS })
    }

    fn stop(&self) -> Option<&AdaptiveStop> {
        self.rule.stop.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter() -> Evidence {
        let mut stream = Stream::new(6, 0);
        let mut point = || [stream.normal() as f32, stream.normal() as f32, stream.normal() as f32];
        Evidence::new((0..20).map(|_| (point(), point())).collect::<Vec<_>>())
    }

    #[test]
    fn a_trial_repeats_and_trials_differ() {
        let evidence = scatter();
        let generator = ThreePoint::new(&evidence, 10, 9);
        assert_eq!(generator.propose(4), generator.propose(4));
        assert_ne!(generator.propose(4), generator.propose(5));
        assert_ne!(generator.propose(4), ThreePoint::new(&evidence, 10, 10).propose(4));
    }

    #[test]
    fn too_few_or_degenerate_pairs_propose_nothing() {
        let on_a_line = |n: usize| Evidence::new((0..n).map(|i| ([i as f32, 0.0, 0.0], [i as f32, 0.0, 0.0])));
        for n in [0, 1, 2, 3, 30] {
            for order in [Order::Uniform, Order::Prosac] {
                let rule = TripleRule { order, ..TripleRule::default() };
                assert!(ThreePoint::with_rule(&on_a_line(n), rule, 10, 0).propose(0).is_none());
            }
        }
    }

    #[test]
    fn edges_decide_as_the_rule_says() {
        // A right triangle with legs 3 and 4, and its double.
        let small = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(Vector3::from);
        let large = small.map(|p| 2.0 * p);
        let rule = |min_edge_ratio, min_spread| TripleRule { min_edge_ratio, min_spread, ..TripleRule::default() };
        for (min_edge_ratio, min_spread, expected) in [
            (0.0, 0.0, true),
            (0.49, 0.0, true),
            (0.5, 0.0, true),
            (0.51, 0.0, false),
            (0.0, 2.9, true),
            (0.0, 3.0, false),
        ] {
            let rule = rule(min_edge_ratio, min_spread);
            assert_eq!(rule.accepts(&small, &large), expected, "{rule:?}");
        }
        assert!(rule(0.51, 0.0).accepts(&small, &small) && rule(0.0, 3.0).accepts(&large, &small));
    }

    #[test]
    fn samples_that_are_drawn_again_are_counted() {
        let evidence = scatter();
        let never = TripleRule { min_spread: 1e9, ..TripleRule::default() };
        assert_eq!(ThreePoint::with_rule(&evidence, never, 10, 0).draw(3), Drawn { pose: None, samples: MAX_REDRAWS });
        let drawn = ThreePoint::new(&evidence, 10, 0).draw(3);
        assert_eq!(drawn, Drawn { pose: ThreePoint::new(&evidence, 10, 0).propose(3), samples: 1 });
        let picky = TripleRule { min_edge_ratio: 0.8, ..TripleRule::default() };
        let generator = ThreePoint::with_rule(&evidence, picky, 10, 0);
        assert!((0..50).any(|trial| generator.draw(trial).samples > 1));
    }
}
