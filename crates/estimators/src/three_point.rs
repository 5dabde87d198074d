//! Plain RANSAC: three random correspondences make a pose.

use crate::HypothesisGenerator;
use congruent_geometry::random::Stream;
use congruent_geometry::{RigidTransform, fit_three};
use congruent_metrics::Evidence;

/// Degenerate samples are drawn again, at most this often, and do not count as trials.
const MAX_REDRAWS: usize = 100;

/// Poses from three different correspondences each, drawn evenly (Fischler and Bolles 1981).
///
/// Three that share a point, or that lie on a line in either cloud, are drawn again.
pub struct ThreePoint<'a> {
    evidence: &'a Evidence,
    trials: u64,
    seed: u64,
}

impl<'a> ThreePoint<'a> {
    /// Draws from `evidence`; fewer than three pairs propose nothing.
    #[must_use]
    pub fn new(evidence: &'a Evidence, trials: u64, seed: u64) -> Self {
        ThreePoint { evidence, trials, seed }
    }
}

impl HypothesisGenerator for ThreePoint<'_> {
    fn trials(&self) -> u64 {
        self.trials
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let n = u32::try_from(self.evidence.len()).ok().filter(|&n| n >= 3)?;
        let mut stream = Stream::new(self.seed, trial);
        (0..MAX_REDRAWS).find_map(|_| {
            let sample = three_of(n, &mut stream).map(|i| i as usize);
            fit_three(&sample.map(|i| self.evidence.source(i)), &sample.map(|i| self.evidence.target(i)))
        })
    }
}

/// Three different numbers below `n`, each triple with the same chance. `n` is at least three.
fn three_of(n: u32, stream: &mut Stream) -> [u32; 3] {
    let first = stream.below(n);
    // Numbers that are taken are stepped over, lowest first.
    let mut second = stream.below(n - 1);
    second += u32::from(second >= first);
    let mut third = stream.below(n - 2);
    third += u32::from(third >= first.min(second));
    third += u32::from(third >= first.max(second));
    [first, second, third]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples_are_different_and_even() {
        let mut stream = Stream::new(5, 0);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..24_000 {
            let [a, b, c] = three_of(4, &mut stream);
            assert!(a != b && b != c && a != c);
            *counts.entry([a, b, c]).or_insert(0u32) += 1;
        }
        // 24 ordered triples, 1000 expected of each, standard deviation 31.
        assert!(counts.len() == 24 && counts.values().all(|&c| c.abs_diff(1000) < 160), "{counts:?}");
    }

    #[test]
    fn a_trial_repeats_and_trials_differ() {
        let mut stream = Stream::new(6, 0);
        let mut point = || [stream.normal() as f32, stream.normal() as f32, stream.normal() as f32];
        let evidence = Evidence::new((0..20).map(|_| (point(), point())).collect::<Vec<_>>());
        let generator = ThreePoint::new(&evidence, 10, 9);
        assert_eq!(generator.propose(4), generator.propose(4));
        assert_ne!(generator.propose(4), generator.propose(5));
        assert_ne!(generator.propose(4), ThreePoint::new(&evidence, 10, 10).propose(4));
    }

    #[test]
    fn too_few_or_degenerate_pairs_propose_nothing() {
        let on_a_line = |n: usize| Evidence::new((0..n).map(|i| ([i as f32, 0.0, 0.0], [i as f32, 0.0, 0.0])));
        for n in [0, 1, 2, 3, 30] {
            assert!(ThreePoint::new(&on_a_line(n), 10, 0).propose(0).is_none());
        }
    }
}
