//! Measures all cells of experiments for one pair.

use super::bench::{Bench, Case, what_is_read};
use super::labels::{estimator_label, metric_label};
use super::plan::{at_threshold, with_iterations};
use super::{Cell, Measured, MeasuredOn, Nuisance, Plan, Shows};
use crate::{InlierShare, inlier_share};
use congruent_estimators::{Hypothesis, HypothesisGenerator, sample_all};
use congruent_geometry::{RawScan, RigidTransform, ScanError};
use congruent_metrics::{Clouds, Evidence, Metric, MetricConfig};
use congruent_pipeline::{Failure, Pair, PipelineConfig, stages};
use std::borrow::Cow;
use std::hint::black_box;
use std::time::Instant;

/// Correspondences with a residual of at most this under the true pose are true, `pr` of the chain.
const INLIER_WITHIN_PR: f64 = 5.0;
/// Number of poses on which a metric is timed …
const TIMED_POSES: usize = 100;
/// … unless it takes longer than this for one pose, microseconds; …
const SLOW: f64 = 1000.0;
/// … then this number.
const TIMED_POSES_IF_SLOW: usize = 10;
/// Number of rounds; the fastest counts.
const TIMED_ROUNDS: usize = 5;

/// A plan, with its variants as configurations.
pub struct Request<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// Name and configuration of each of the plan's variants, in its order.
    pub variants: &'a [(String, PipelineConfig)],
}

/// Why a pair has no results.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A scan cannot be used.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// A scan cannot be sampled.
    #[error(transparent)]
    Failure(#[from] Failure),
    /// The scans share too little surface under the truth.
    #[error("not evaluable: {shared} shared points")]
    NotEvaluable {
        /// Points in `C_gt`.
        shared: usize,
    },
}

/// Measures all cells of each plan; returns one list for each plan, in its order. Each stage is run once for all plans
/// that need it. The poses of an estimator on the same matches are proposed once, for all metrics, thresholds and
/// numbers of trials that use them.
///
/// # Errors
/// A scan cannot be used or sampled, or the pair is not evaluable.
pub fn run_pair(
    requests: &[Request<'_>],
    scans: Pair<&RawScan>,
    target_from_source: &RigidTransform,
) -> Result<Vec<Vec<Measured>>, Problem> {
    let mut bench = Bench::new(scans, target_from_source)?;
    let mut streams: Vec<Stream> = Vec::new();
    for request in requests {
        for stream in request.streams() {
            match streams.iter_mut().find(|known| known.is_same(&stream)) {
                Some(known) => known.also(stream),
                None => streams.push(stream),
            }
        }
    }
    for stream in &mut streams {
        let case = bench.case(&stream.config, stream.nuisance, stream.measured_on)?;
        stream.run(&case);
    }
    Ok(requests.iter().map(|request| request.collect(&streams)).collect())
}

impl Request<'_> {
    /// Returns the streams that have to be proposed and ranked, in the plan's order.
    fn streams(&self) -> Vec<Stream> {
        let plan = self.plan;
        let mut streams = Vec::new();
        for (_, config) in self.variants {
            for &nuisance in &plan.nuisances {
                for estimator in &plan.estimators {
                    let name = estimator_label(estimator);
                    let estimator = with_iterations(estimator, plan.iterations.iter().copied().max().unwrap_or(0));
                    streams.push(Stream {
                        estimator: name,
                        config: PipelineConfig { estimator, ..what_is_read(config) },
                        nuisance,
                        measured_on: plan.measured_on,
                        shows: plan.shows,
                        wanted: plan.ranks(),
                        iterations: plan.iterations.clone(),
                        share: InlierShare::default(),
                        found: Vec::new(),
                    });
                }
            }
        }
        streams
    }

    /// Collects the results of the plan, in its order.
    fn collect(&self, streams: &[Stream]) -> Vec<Measured> {
        let (plan, mut measured) = (self.plan, Vec::new());
        let names = self.variants.iter().flat_map(|(name, _)| {
            plan.nuisances.iter().flat_map(move |nuisance| plan.estimators.iter().map(move |_| (name, nuisance)))
        });
        for ((variant, nuisance), asked) in names.zip(self.streams()) {
            let stream = streams.iter().find(|stream| stream.is_same(&asked)).expect("all streams were run");
            let cell = |metric, threshold_pr, iterations| Cell {
                variant: variant.clone(),
                nuisance: nuisance.to_string(),
                estimator: asked.estimator.clone(),
                iterations,
                metric,
                threshold_pr,
            };
            let share = stream.share;
            if plan.shows == Shows::Inliers {
                let cell = Cell { estimator: "".into(), ..cell("".into(), 0.0, 0) };
                measured.push(Measured { cell, rmse_pr: None, share, microseconds: None });
            }
            for rank in &asked.wanted {
                let found = stream.found(rank);
                for &iterations in &plan.iterations {
                    let rmse_pr = found.rmse_pr.iter().find(|(n, _)| *n == iterations).and_then(|(_, rmse)| *rmse);
                    let cell = cell(rank.name.clone(), rank.threshold_pr, iterations);
                    measured.push(Measured { cell, rmse_pr, share, microseconds: found.microseconds });
                }
            }
        }
        measured
    }
}

impl Plan {
    /// Returns every metric at every threshold.
    fn ranks(&self) -> Vec<Rank> {
        let thresholds = &self.thresholds_pr;
        let at = |metric| {
            let rank = move |&t| Rank { name: metric_label(metric), threshold_pr: t, metric: at_threshold(metric, t) };
            thresholds.iter().map(rank)
        };
        self.metrics.iter().flat_map(at).collect()
    }
}

/// One way to rank the poses of a stream.
#[derive(Clone, PartialEq)]
struct Rank {
    name: Cow<'static, str>,
    threshold_pr: f64,
    metric: MetricConfig,
}

/// The results of one ranking.
struct Found {
    rank: Rank,
    /// RMSE of the best pose for each number of trials.
    rmse_pr: Vec<(u64, Option<f64>)>,
    microseconds: Option<f64>,
}

/// The poses of one estimator on one set of matches, and all rankings of them.
struct Stream {
    /// Name of the estimator.
    estimator: Cow<'static, str>,
    /// The settings that are read, with defaults for all others.
    config: PipelineConfig,
    nuisance: Nuisance,
    measured_on: MeasuredOn,
    shows: Shows,
    wanted: Vec<Rank>,
    iterations: Vec<u64>,
    share: InlierShare,
    found: Vec<Found>,
}

impl Stream {
    /// Returns whether the poses are the same. The number of iterations is part of the estimator, so that a metric that
    /// is wanted only for few iterations does not score the poses of many.
    fn is_same(&self, other: &Stream) -> bool {
        let key = |s: &Stream| (s.nuisance, s.measured_on, s.shows);
        key(self) == key(other) && self.config == other.config
    }

    /// Adds the rankings and the numbers of trials that another request wants.
    fn also(&mut self, other: Stream) {
        let new_ranks = other.wanted.into_iter().filter(|rank| !self.wanted.contains(rank)).collect::<Vec<_>>();
        self.wanted.extend(new_ranks);
        let new_budgets = other.iterations.into_iter().filter(|n| !self.iterations.contains(n)).collect::<Vec<_>>();
        self.iterations.extend(new_budgets);
    }

    fn found(&self, rank: &Rank) -> &Found {
        self.found.iter().find(|found| found.rank == *rank).expect("all ranks were run")
    }

    fn run(&mut self, case: &Case) {
        let evidence = stages::evidence(&case.surfaces, &case.matches, &self.config, case.resolution);
        let truth = case.to_clean.inverse() * case.judge.centred();
        self.share = inlier_share(&evidence, &truth, INLIER_WITHIN_PR * case.resolution);
        let generator = self.config.estimator.build(&evidence, case.resolution, self.config.seed);
        let clouds = Clouds { source: &case.surfaces.source, target: &case.surfaces.target };
        let metrics: Vec<Box<dyn Metric>> =
            self.wanted.iter().map(|rank| rank.metric.build(case.resolution, clouds)).collect();
        let lent: Vec<&dyn Metric> = metrics.iter().map(AsRef::as_ref).collect();
        self.found = match self.shows {
            Shows::Accuracy => self.ranked(case, generator.as_ref(), &lent, &evidence),
            Shows::Time => self.timed(generator.as_ref(), &lent, &evidence),
            Shows::Inliers => Vec::new(),
        };
    }

    fn ranked(
        &self,
        case: &Case,
        generator: &dyn HypothesisGenerator,
        metrics: &[&dyn Metric],
        evidence: &Evidence,
    ) -> Vec<Found> {
        // The best hypothesis of all suffices if no number of iterations excludes it.
        let every_trial_counts = self.iterations.iter().all(|&iterations| iterations >= generator.trials());
        let keep = if every_trial_counts { 1 } else { usize::MAX };
        let rankings = sample_all(generator, metrics, evidence, keep);
        let rmse_pr = |ranking: &[Hypothesis], iterations| {
            best(ranking, iterations).and_then(|pose| case.judge.rmse_pr(&(case.to_clean * pose)))
        };
        let found = self.wanted.iter().zip(&rankings).map(|(rank, ranking)| Found {
            rank: rank.clone(),
            rmse_pr: self.iterations.iter().map(|&n| (n, rmse_pr(ranking, n))).collect(),
            microseconds: None,
        });
        found.collect()
    }

    fn timed(&self, generator: &dyn HypothesisGenerator, metrics: &[&dyn Metric], evidence: &Evidence) -> Vec<Found> {
        let poses: Vec<RigidTransform> =
            (0..generator.trials()).filter_map(|trial| generator.propose(trial)).take(TIMED_POSES).collect();
        let found = self.wanted.iter().zip(metrics).map(|(rank, metric)| Found {
            rank: rank.clone(),
            rmse_pr: Vec::new(),
            microseconds: time_of(*metric, &poses, evidence),
        });
        found.collect()
    }
}

/// Returns the best pose among the first trials.
fn best(ranked: &[Hypothesis], iterations: u64) -> Option<RigidTransform> {
    ranked.iter().find(|h| h.trial < iterations).map(|h| h.target_from_source)
}

/// Returns the mean time for one pose in the fastest round, microseconds; `None` for no poses.
fn time_of(metric: &dyn Metric, poses: &[RigidTransform], evidence: &Evidence) -> Option<f64> {
    let round = |poses: &[RigidTransform]| {
        let start = Instant::now();
        for pose in poses {
            black_box(metric.score(evidence, pose));
        }
        start.elapsed().as_secs_f64() * 1e6 / poses.len() as f64
    };
    let slow = round(poses.get(..1)?) > SLOW;
    let poses = if slow { &poses[..TIMED_POSES_IF_SLOW.min(poses.len())] } else { poses };
    // Several rounds: one of a fast metric is shorter than an interruption by another process, so the fastest is
    // undisturbed.
    Some((0..TIMED_ROUNDS).map(|_| round(poses)).fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests;
