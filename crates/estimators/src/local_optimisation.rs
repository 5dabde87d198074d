//! Local optimisation: a hypothesis from three points is fitted to all correspondences that agree with it.
//!
//! Iteratively reweighted least squares with the metric's own weights. If the metric's loss is concave in the squared
//! residual (MAE, MSE, LOG-COSH), each weighted fit minimises an upper bound of the loss that touches it at the present
//! pose, so the score never falls.

use crate::{Distinctness, Hypothesis};
use congruent_geometry::{RigidTransform, Spare, fit_weighted};
use congruent_metrics::{Evidence, Metric};
use rayon::prelude::*;

/// Gain, as a fraction of the score, below which the rounds end.
const MIN_GAIN: f64 = 1e-6;
/// Maximum number of poses that one thread takes at a time.
const CLIMBS_AT_A_TIME: usize = 8;

/// Raises the scores of many poses in parallel, and returns them best first. Where poses converge, only the best of
/// them is followed.
///
/// The scores of the hypotheses must be those of `metric`; ties go to the lower trial.
#[must_use]
pub fn optimise_all(
    starts: Vec<Hypothesis>,
    metric: &dyn Metric,
    evidence: &Evidence,
    rounds: usize,
    distinctness: &Distinctness,
) -> Vec<Hypothesis> {
    let slope = Slope::new(metric, evidence);
    let mut climbs: Vec<Climb> = starts.into_iter().map(Climb::new).collect();
    for _ in 0..rounds {
        climbs.par_iter_mut().with_max_len(CLIMBS_AT_A_TIME).for_each(|climb| climb.step(&slope));
        climbs.sort_by(|a, b| a.best.best_first(&b.best));
        let apart = distinctness.positions(&climbs, |climb| &climb.best.target_from_source, usize::MAX);
        climbs = apart.into_iter().map(|position| climbs[position]).collect();
    }
    climbs.into_iter().map(|climb| climb.best).collect()
}

/// A pose whose score is being raised.
#[derive(Clone, Copy)]
struct Climb {
    best: Hypothesis,
    pose: RigidTransform,
    /// Whether the last fit has gained next to nothing.
    is_done: bool,
}

impl Climb {
    fn new(start: Hypothesis) -> Self {
        Climb { best: start, pose: start.target_from_source, is_done: false }
    }

    fn step(&mut self, slope: &Slope) {
        if self.is_done {
            return;
        }
        let Some(next) = slope.refit(&self.pose) else {
            self.is_done = true;
            return;
        };
        let score = slope.metric.score(slope.evidence, &next);
        let gain = score.value() - self.best.score.value();
        if score > self.best.score {
            self.best = Hypothesis { target_from_source: next, score, ..self.best };
        }
        self.is_done = gain <= MIN_GAIN * self.best.score.value().abs();
        self.pose = next;
    }
}

/// The objective by which poses are raised.
struct Slope<'a> {
    metric: &'a dyn Metric,
    evidence: &'a Evidence,
    /// Buffers for squared residuals and weights.
    spare: Spare<(Vec<f32>, Vec<f64>)>,
}

impl<'a> Slope<'a> {
    fn new(metric: &'a dyn Metric, evidence: &'a Evidence) -> Self {
        Slope { metric, evidence, spare: Spare::default() }
    }

    /// Performs one weighted fit.
    fn refit(&self, pose: &RigidTransform) -> Option<RigidTransform> {
        self.spare.with(|(residuals_sq, weights)| {
            self.evidence.residuals_sq(pose, residuals_sq);
            self.metric.weights(residuals_sq, weights);
            let counted = weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0);
            fit_weighted(counted.map(|(i, weight)| (self.evidence.source(i), self.evidence.target(i), *weight)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_geometry::{fit_three, mean_displacement, narrow};
    use congruent_metrics::{LogCosh, Mae, Mse, Score, Summed};
    use nalgebra::{Point3, Vector3};

    /// 60 inliers with noise among 200 pairs in a box of side 100, and the true pose.
    fn scene(seed: u64) -> (Evidence, RigidTransform) {
        let mut stream = Stream::new(seed, 0);
        let truth = RigidTransform::from_parts(nalgebra::Translation3::new(5.0, -8.0, 2.0), stream.rotation());
        let mut point = |side: f64| Vector3::from_fn(|_, _| stream.between(-side, side));
        let pairs: Vec<_> = (0..200)
            .map(|i| {
                let p = point(50.0);
                let q = if i < 60 { (truth * Point3::from(p)).coords + point(2.0) } else { point(50.0) };
                (narrow(&p), narrow(&q))
            })
            .collect();
        (Evidence::new(pairs), truth)
    }

    /// Raises a pose's score by at most `rounds` weighted fits; returns the best pose seen, the start included.
    fn optimise(
        start: &RigidTransform,
        metric: &dyn Metric,
        evidence: &Evidence,
        rounds: usize,
    ) -> (RigidTransform, Score) {
        let slope = Slope::new(metric, evidence);
        let score = metric.score(evidence, start);
        let mut climb = Climb::new(Hypothesis { target_from_source: *start, score, trial: 0 });
        for _ in 0..rounds {
            climb.step(&slope);
        }
        (climb.best.target_from_source, climb.best.score)
    }

    fn three_point_pose(evidence: &Evidence) -> RigidTransform {
        fit_three(&[0, 1, 2].map(|i| evidence.source(i)), &[0, 1, 2].map(|i| evidence.target(i))).unwrap()
    }

    #[test]
    fn the_score_never_falls() {
        let metrics: [&dyn Metric; 3] =
            [&Summed(Mae::new(7.5)), &Summed(Mse::new(7.5)), &Summed(LogCosh::new(7.5, 1.0))];
        for seed in 0..100 {
            let (evidence, _) = scene(seed);
            for metric in metrics {
                let mut pose = three_point_pose(&evidence);
                let mut score = metric.score(&evidence, &pose).value();
                for _ in 0..20 {
                    let Some(next) = Slope::new(metric, &evidence).refit(&pose) else { break };
                    let after = metric.score(&evidence, &next).value();
                    // Sums of `f32` gains are reproducible to about six digits.
                    assert!(after >= score - 2e-5 * score.abs(), "seed {seed}: {score} fell to {after}");
                    (pose, score) = (next, after);
                }
            }
        }
    }

    #[test]
    fn the_pose_comes_closer_to_the_truth() {
        let metric = Summed(Mse::new(7.5));
        let (mut before, mut after) = (0.0, 0.0);
        for seed in 0..50 {
            let (evidence, truth) = scene(seed);
            let probes: Vec<_> = (0..60).map(|i| narrow(&evidence.source(i))).collect();
            let start = three_point_pose(&evidence);
            let (end, _) = optimise(&start, &metric, &evidence, 20);
            before += mean_displacement(&probes, &start, &truth);
            after += mean_displacement(&probes, &end, &truth);
        }
        assert!(after < 0.4 * before, "{before} {after}");
    }

    #[test]
    fn poses_that_come_together_are_followed_once() {
        let metric = Summed(Mse::new(7.5));
        let (evidence, truth) = scene(3);
        let probes: Vec<_> = (0..60).map(|i| narrow(&evidence.source(i))).collect();
        let moved = |x: f64| RigidTransform::translation(x, 0.0, 0.0) * truth;
        // Four poses close to the true one, and one from which nothing leads there.
        let starts: Vec<Hypothesis> = (0u64..)
            .zip([3.0, -2.0, 1.0, -4.0, 1e4])
            .map(|(trial, x)| (trial, moved(x)))
            .map(|(trial, pose)| Hypothesis { target_from_source: pose, score: metric.score(&evidence, &pose), trial })
            .collect();
        let distinctness = Distinctness::new(&probes, 0.5);
        let ends = optimise_all(starts.clone(), &metric, &evidence, 10, &distinctness);
        assert_eq!(ends.len(), 2);
        assert!(mean_displacement(&probes, &ends[0].target_from_source, &truth) < 0.6 && ends[1].trial == 4);
        // The pose that was followed ends where it would have ended alone.
        let alone = optimise(&moved([3.0, -2.0, 1.0, -4.0][ends[0].trial as usize]), &metric, &evidence, 10);
        assert_eq!((ends[0].target_from_source, ends[0].score), alone);
        // Without rounds they remain as they were.
        assert_eq!(optimise_all(starts, &metric, &evidence, 0, &distinctness).len(), 5);
    }

    #[test]
    fn a_pose_without_inliers_is_left_alone() {
        let (evidence, _) = scene(1);
        let far = RigidTransform::translation(1e5, 0.0, 0.0);
        assert_eq!(optimise(&far, &Summed(Mse::new(7.5)), &evidence, 5), (far, Score::new(0.0)));
    }
}
