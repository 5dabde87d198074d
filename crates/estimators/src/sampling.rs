//! The sampling loop: every estimator runs in it, whatever it proposes and whatever scores it.

use congruent_geometry::RigidTransform;
use congruent_metrics::{Evidence, Metric, Score};
use rayon::prelude::*;

/// Trials that one thread takes at a time.
const BATCH: u64 = 64;

/// Proposes poses.
pub trait HypothesisGenerator: Send + Sync {
    /// How many trials there are to run.
    fn trials(&self) -> u64;

    /// The pose of one trial: a pure function of the generator's seed and the trial's number. `None` where the trial
    /// found no usable sample.
    fn propose(&self, trial: u64) -> Option<RigidTransform>;
}

/// A proposed pose and how good it is.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis {
    /// Between the centred clouds.
    pub target_from_source: RigidTransform,
    /// By the metric of the run.
    pub score: Score,
    /// The trial that proposed it.
    pub trial: u64,
}

/// Runs all trials and keeps the best `keep` hypotheses, best first; of equal scores the lower trial comes first.
///
/// The result does not depend on the number of threads.
#[must_use]
pub fn sample(
    generator: &dyn HypothesisGenerator,
    metric: &dyn Metric,
    evidence: &Evidence,
    keep: usize,
) -> Vec<Hypothesis> {
    let trials = generator.trials();
    let batches: Vec<Vec<Hypothesis>> = (0..trials.div_ceil(BATCH))
        .into_par_iter()
        .map(|batch| {
            let trials = batch * BATCH..trials.min((batch + 1) * BATCH);
            best(trials.filter_map(|trial| hypothesis(generator, metric, evidence, trial)).collect(), keep)
        })
        .collect();
    best(batches.into_iter().flatten().collect(), keep)
}

fn hypothesis(
    generator: &dyn HypothesisGenerator,
    metric: &dyn Metric,
    evidence: &Evidence,
    trial: u64,
) -> Option<Hypothesis> {
    let target_from_source = generator.propose(trial)?;
    Some(Hypothesis { target_from_source, score: metric.score(evidence, &target_from_source), trial })
}

fn best(mut hypotheses: Vec<Hypothesis>, keep: usize) -> Vec<Hypothesis> {
    hypotheses.sort_by(|a, b| b.score.cmp(&a.score).then(a.trial.cmp(&b.trial)));
    hypotheses.truncate(keep);
    hypotheses
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trial `i` proposes a shift by `script[i]`, or nothing.
    struct Script(Vec<Option<f64>>);
    impl HypothesisGenerator for Script {
        fn trials(&self) -> u64 {
            self.0.len() as u64
        }
        fn propose(&self, trial: u64) -> Option<RigidTransform> {
            self.0[trial as usize].map(|x| RigidTransform::translation(x, 0.0, 0.0))
        }
    }

    /// Scores a shift by itself.
    struct Shift;
    impl Metric for Shift {
        fn score(&self, _: &Evidence, pose: &RigidTransform) -> Score {
            Score::new(pose.translation.vector.x)
        }
        fn weight(&self, _: f64) -> f64 {
            0.0
        }
    }

    fn trials(script: Vec<Option<f64>>, keep: usize) -> Vec<u64> {
        sample(&Script(script), &Shift, &Evidence::default(), keep).iter().map(|h| h.trial).collect()
    }

    #[test]
    fn the_best_come_first_and_ties_go_to_the_lower_trial() {
        let mut script = vec![Some(-1.0); 300];
        script[170] = Some(5.0);
        script[20] = Some(5.0);
        script[299] = Some(7.0);
        script[0] = None;
        assert_eq!(trials(script, 5), [299, 20, 170, 1, 2]);
    }

    #[test]
    fn scores_below_zero_and_not_a_number_still_rank() {
        assert_eq!(trials(vec![Some(f64::NAN), Some(-3.0), Some(-2.0)], 2), [2, 1]);
    }

    #[test]
    fn no_trial_no_hypothesis() {
        assert!(trials(vec![], 1).is_empty() && trials(vec![None, None], 1).is_empty());
    }

    #[test]
    fn threads_do_not_matter() {
        let script: Vec<_> = (0..1000).map(|i| Some(f64::from((i * 7919) % 101))).collect();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| trials(script.clone(), 50))
        };
        assert_eq!(run(1), run(4));
    }
}
