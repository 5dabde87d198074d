//! The sampling loop: every estimator runs in it, whatever it proposes and whichever metric scores it.

use crate::AdaptiveStop;
use congruent_geometry::RigidTransform;
use congruent_metrics::{Evidence, Metric, Score};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::ops::Range;

/// Number of trials that one thread takes at a time.
const BATCH: u64 = 64;
/// Number of trials between two checks of the stopping rule: the same for any number of threads, and large enough that
/// the first check is not a matter of chance.
const ROUND: u64 = 256;
/// Number of trials in a round if no rule stops them: only what is kept of one round is carried over to the next.
const LONG_ROUND: u64 = 1 << 16;

/// Proposes poses.
pub trait HypothesisGenerator: Send + Sync {
    /// Returns the number of trials to run.
    fn trials(&self) -> u64;

    /// Returns the pose of one trial: a pure function of the generator's seed and the trial's number. `None` if the
    /// trial found no usable sample.
    fn propose(&self, trial: u64) -> Option<RigidTransform>;

    /// Returns the pose of one trial with the number of samples drawn; for generators that redraw unusable samples.
    fn draw(&self, trial: u64) -> Drawn {
        Drawn { pose: self.propose(trial), samples: 1 }
    }

    /// Returns the rule for stopping before all trials are done, if any.
    fn stop(&self) -> Option<&AdaptiveStop> {
        None
    }
}

/// The outcome of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// The pose, if any sample was usable.
    pub pose: Option<RigidTransform>,
    /// Number of samples drawn, including unusable ones.
    pub samples: u64,
}

/// A proposed pose and its score.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis {
    /// Pose between the centred clouds.
    pub target_from_source: RigidTransform,
    /// Score by the metric of the run.
    pub score: Score,
    /// The trial that proposed it.
    pub trial: u64,
}

impl Hypothesis {
    /// Orders a ranking: better scores first, ties by the lower trial.
    #[must_use]
    pub fn best_first(&self, other: &Hypothesis) -> Ordering {
        other.score.cmp(&self.score).then(self.trial.cmp(&other.trial))
    }
}

/// Runs all trials and returns the best `keep` hypotheses, best first; ties go to the lower trial.
///
/// Poses that the metric rejects ([`Score::WORST`]) are left out. The result does not depend on the number of threads.
#[must_use]
pub fn sample(
    generator: &dyn HypothesisGenerator,
    metric: &dyn Metric,
    evidence: &Evidence,
    keep: usize,
) -> Vec<Hypothesis> {
    sample_all(generator, &[metric], evidence, keep).remove(0)
}

/// Runs all trials for several metrics at once, with one ranking each: every pose is proposed once and scored by all of
/// them.
#[must_use]
pub fn sample_all(
    generator: &dyn HypothesisGenerator,
    metrics: &[&dyn Metric],
    evidence: &Evidence,
    keep: usize,
) -> Vec<Vec<Hypothesis>> {
    let trials = generator.trials();
    let round = if generator.stop().is_some() { ROUND } else { LONG_ROUND };
    let run = Run { generator, metrics, evidence, keep };
    let mut found = run.nothing(0);
    for start in (0..trials).step_by(round as usize) {
        found = run.round(found, start..trials.min(start + round));
        if generator.stop().is_some_and(|stop| stop.enough(found.samples, found.inliers, evidence.len())) {
            break;
        }
    }
    found.ranked.into_iter().map(sorted).collect()
}

/// Sorts best first. The order of all batches together is determined by score and trial alone.
fn sorted(mut hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    hypotheses.par_sort_unstable_by(Hypothesis::best_first);
    hypotheses
}

/// The input of one pass through the loop.
struct Run<'a> {
    generator: &'a dyn HypothesisGenerator,
    metrics: &'a [&'a dyn Metric],
    evidence: &'a Evidence,
    keep: usize,
}

/// What some trials have found.
struct Found {
    /// One list for each metric, in no particular order.
    ranked: Vec<Vec<Hypothesis>>,
    /// Of the pose that has most, whatever the metrics say, so that they all see the same poses; counted only for the
    /// stopping rule.
    inliers: usize,
    samples: u64,
}

impl Run<'_> {
    /// Returns an empty result with room for this many hypotheses per metric.
    fn nothing(&self, room: usize) -> Found {
        let ranked = self.metrics.iter().map(|_| Vec::with_capacity(room)).collect();
        Found { ranked, inliers: 0, samples: 0 }
    }

    /// Adds the trials of one round to what was found before.
    fn round(&self, before: Found, trials: Range<u64>) -> Found {
        let batches: Vec<Found> = (0..(trials.end - trials.start).div_ceil(BATCH) as usize)
            .into_par_iter()
            .with_max_len(1)
            .map(|batch| {
                let start = trials.start + batch as u64 * BATCH;
                self.batch(start..trials.end.min(start + BATCH))
            })
            .collect();
        let mut found = batches.into_iter().fold(before, Found::and);
        found.cut(self.keep);
        found
    }

    fn batch(&self, trials: Range<u64>) -> Found {
        let mut found = self.nothing((trials.end - trials.start) as usize);
        for trial in trials {
            let Drawn { pose, samples } = self.generator.draw(trial);
            found.samples += samples;
            if let Some(pose) = pose {
                self.judge(&pose, trial, &mut found);
            }
        }
        found.cut(self.keep);
        found
    }

    fn judge(&self, pose: &RigidTransform, trial: u64, found: &mut Found) {
        for (metric, ranked) in self.metrics.iter().zip(&mut found.ranked) {
            let score = metric.score(self.evidence, pose);
            if score > Score::WORST {
                ranked.push(Hypothesis { target_from_source: *pose, score, trial });
            }
        }
        if let Some(stop) = self.generator.stop() {
            found.inliers = found.inliers.max(stop.inliers(self.evidence, pose));
        }
    }
}

impl Found {
    fn and(mut self, other: Found) -> Found {
        for (ranked, more) in self.ranked.iter_mut().zip(other.ranked) {
            ranked.extend(more);
        }
        self.inliers = self.inliers.max(other.inliers);
        self.samples += other.samples;
        self
    }

    /// Keeps the best of each ranking, in no particular order.
    fn cut(&mut self, keep: usize) {
        for ranked in self.ranked.iter_mut().filter(|ranked| ranked.len() > keep) {
            if keep > 0 {
                ranked.select_nth_unstable_by(keep - 1, Hypothesis::best_first);
            }
            ranked.truncate(keep);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trial `i` proposes a translation by `script[i]`, or nothing.
    struct Script(Vec<Option<f64>>);
    impl HypothesisGenerator for Script {
        fn trials(&self) -> u64 {
            self.0.len() as u64
        }
        fn propose(&self, trial: u64) -> Option<RigidTransform> {
            self.0[trial as usize].map(|x| RigidTransform::translation(x, 0.0, 0.0))
        }
    }

    /// Scores a translation by its x component.
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
    fn scores_below_zero_rank_and_what_is_no_number_does_not() {
        assert_eq!(trials(vec![Some(f64::NAN), Some(-3.0), Some(-2.0)], 3), [2, 1]);
    }

    /// Scores a translation by how short it is.
    struct Still;
    impl Metric for Still {
        fn score(&self, _: &Evidence, pose: &RigidTransform) -> Score {
            Score::new(-pose.translation.vector.norm())
        }
        fn weight(&self, _: f64) -> f64 {
            0.0
        }
    }

    #[test]
    fn each_metric_ranks_the_same_poses_its_own_way() {
        let script = Script((0..300).map(|i| Some(f64::from((i * 7919) % 301) - 150.0)).collect());
        let none = Evidence::default();
        let both = sample_all(&script, &[&Shift, &Still], &none, 9);
        for (ranked, metric) in both.iter().zip([&Shift as &dyn Metric, &Still]) {
            let alone: Vec<u64> = sample(&script, metric, &none, 9).iter().map(|h| h.trial).collect();
            assert_eq!(ranked.iter().map(|h| h.trial).collect::<Vec<_>>(), alone);
        }
        assert!(both[0][0].trial != both[1][0].trial && sample_all(&script, &[], &none, 9).is_empty());
    }

    /// Proposes a translation by the trial's number after two futile samples; trial 300 hits.
    struct Counted {
        trials: u64,
        stop: AdaptiveStop,
    }
    impl HypothesisGenerator for Counted {
        fn trials(&self) -> u64 {
            self.trials
        }
        fn propose(&self, trial: u64) -> Option<RigidTransform> {
            let x = if trial == 300 { 0.0 } else { 1e3 + trial as f64 };
            Some(RigidTransform::translation(x, 0.0, 0.0))
        }
        fn draw(&self, trial: u64) -> Drawn {
            Drawn { pose: self.propose(trial), samples: 3 }
        }
        fn stop(&self) -> Option<&AdaptiveStop> {
            Some(&self.stop)
        }
    }

    #[test]
    fn sampling_stops_at_the_end_of_a_round_once_enough_is_drawn() {
        // 10 of 100 pairs agree with trial 300: 9305 samples are needed, which is 3102 trials of three samples, or 3328
        // in whole rounds.
        let pairs = (0..100).map(|i| ([i as f32, 0.0, 0.0], [i as f32, if i < 10 { 0.0 } else { 500.0 }, 0.0]));
        let evidence = Evidence::new(pairs);
        for (trials, expected) in [(100_000, 3327), (2000, 1999)] {
            let generator = Counted { trials, stop: AdaptiveStop::new(0.999, 7.5, 3) };
            // The largest translation is that of the last trial.
            let last = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| sample(&generator, &Shift, &evidence, 1)[0].trial)
            };
            assert_eq!((last(1), last(4)), (expected, expected));
        }
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
