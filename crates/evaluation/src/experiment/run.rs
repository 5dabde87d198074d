//! All cells of an experiment for one pair.

use super::plan::{at_threshold, estimator_name, with_iterations};
use super::{MeasuredOn, Nuisance, Plan, metric_name};
use crate::{GroundTruth, InlierShare, inlier_share};
use congruent_estimators::{Hypothesis, HypothesisGenerator, sample_all};
use congruent_geometry::{Length, RawScan, RigidTransform, Scan, ScanError, Surface};
use congruent_matching::Correspondence;
use congruent_metrics::{Clouds, Evidence, Metric, MetricConfig};
use congruent_pipeline::stages::{self, Prepared};
use congruent_pipeline::{Failure, Pair, PipelineConfig, SamplingConfig};
use std::hint::black_box;
use std::time::Instant;

/// True correspondences are counted within this distance, `pr` of the chain.
const INLIER_WITHIN_PR: f64 = 5.0;
/// Poses that a metric is timed on.
const TIMED_POSES: usize = 100;
/// How often; the fastest round counts.
const TIMED_ROUNDS: usize = 5;

/// Where in the sweep a result belongs.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Name of the change to the chain.
    pub variant: String,
    /// Name of what the target was spoilt with.
    pub nuisance: String,
    /// Who proposed.
    pub estimator: &'static str,
    /// How much of the stream was looked at.
    pub iterations: u64,
    /// Who ranked.
    pub metric: &'static str,
    /// Inlier threshold, `pr` of the chain.
    pub threshold_pr: f64,
}

/// What one cell says of one pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Which.
    pub cell: Cell,
    /// Of the best pose; nothing where there was none.
    pub rmse_pr: Option<f64>,
    /// Of the matches.
    pub share: InlierShare,
    /// Time for one pose, microseconds, on one thread; nothing where that was not asked for.
    pub microseconds: Option<f64>,
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

/// Runs the chain up to the matches for every variant and nuisance, and all that the plan sweeps on top of that.
/// `variants` are the plan's, as configurations.
///
/// # Errors
/// The pair cannot be used or judged.
pub fn run_pair(
    plan: &Plan,
    variants: &[(String, PipelineConfig)],
    scans: Pair<&RawScan>,
    target_from_source: &RigidTransform,
) -> Result<Vec<Measured>, Problem> {
    let mut measured = Vec::new();
    let clean = scans.map(|raw| Scan::new(raw)).both()?;
    for (name, config) in variants {
        let Prepared { surfaces, raw_resolution, resolution } =
            stages::prepare(&[&clean.source, &clean.target], config, None)?;
        let surfaces = Pair::of_two(surfaces);
        let judge = judge(plan.measured_on, &clean, &surfaces, target_from_source);
        if !judge.is_evaluable() {
            return Err(Problem::NotEvaluable { shared: judge.n_shared() });
        }
        // Lengths stay those of the unspoilt pair: a nuisance changes the data, not the settings.
        let config = with_fixed_leaf(config, raw_resolution);
        for nuisance in &plan.nuisances {
            let spoilt = Scan::new(&nuisance.apply(scans.target, raw_resolution, config.seed))?;
            let prepared;
            let (surfaces, origin) = if *nuisance == (Nuisance::None {}) {
                (&surfaces, clean.target.origin())
            } else {
                prepared =
                    Pair::of_two(stages::prepare(&[&clean.source, &spoilt], &config, Some(resolution))?.surfaces);
                (&prepared, spoilt.origin())
            };
            let to_clean = RigidTransform::translation(
                origin.x - clean.target.origin().x,
                origin.y - clean.target.origin().y,
                origin.z - clean.target.origin().z,
            );
            let case = Case { plan, config: &config, surfaces, resolution, judge: &judge, to_clean };
            case.run(name, &nuisance.to_string(), &mut measured);
        }
    }
    Ok(measured)
}

fn judge(on: MeasuredOn, scans: &Pair<Scan>, surfaces: &Pair<Surface>, truth: &RigidTransform) -> GroundTruth {
    match on {
        MeasuredOn::Scans => GroundTruth::of_scans(scans.as_ref(), truth),
        MeasuredOn::Sampled => {
            let origins = Pair { source: *scans.source.origin(), target: *scans.target.origin() };
            let points = Pair { source: surfaces.source.points(), target: surfaces.target.points() };
            GroundTruth::of_points(points, origins, truth)
        }
    }
}

/// The same grid for any scan.
fn with_fixed_leaf(config: &PipelineConfig, raw_resolution: f64) -> PipelineConfig {
    let mut config = config.clone();
    let leaf = match &mut config.sampling {
        SamplingConfig::None {} => return config,
        SamplingConfig::VoxelGrid(grid) => &mut grid.leaf,
        SamplingConfig::Budget(budget) => &mut budget.leaf,
    };
    *leaf = Length::Units(leaf.resolve(raw_resolution));
    config
}

/// One variant under one nuisance.
struct Case<'a> {
    plan: &'a Plan,
    config: &'a PipelineConfig,
    surfaces: &'a Pair<Surface>,
    resolution: f64,
    judge: &'a GroundTruth,
    /// From the centred spoilt target to the centred clean one.
    to_clean: RigidTransform,
}

impl Case<'_> {
    fn run(&self, variant: &str, nuisance: &str, measured: &mut Vec<Measured>) {
        let matches = self.matches();
        for estimator in &self.plan.estimators {
            let most = self.plan.iterations.iter().copied().max().unwrap_or(0);
            let estimator = with_iterations(estimator, most);
            let name = estimator_name(&estimator);
            let config = PipelineConfig { estimator, ..self.config.clone() };
            let evidence = stages::evidence(self.surfaces, &matches, &config, self.resolution);
            let truth = self.to_clean.inverse() * self.judge.centred();
            let share = inlier_share(&evidence, &truth, INLIER_WITHIN_PR * self.resolution);
            let generator = config.estimator.build(&evidence, self.resolution, config.seed);
            let cell = |iterations, metric: &MetricConfig, threshold_pr| Cell {
                variant: variant.to_owned(),
                nuisance: nuisance.to_owned(),
                estimator: name,
                iterations,
                metric: metric_name(metric),
                threshold_pr,
            };
            let ranks = self.ranks();
            let metrics: Vec<Box<dyn Metric>> = ranks.iter().map(|(_, _, metric)| self.built(metric)).collect();
            let lent: Vec<&dyn Metric> = metrics.iter().map(AsRef::as_ref).collect();
            let keep = if self.plan.iterations.len() == 1 { 1 } else { usize::MAX };
            let ranked = sample_all(generator.as_ref(), &lent, &evidence, keep);
            for ((threshold_pr, metric, _), (built, ranked)) in ranks.iter().zip(lent.iter().zip(&ranked)) {
                let microseconds = self.plan.timed.then(|| time_of(*built, generator.as_ref(), &evidence)).flatten();
                for &iterations in &self.plan.iterations {
                    let rmse_pr = best(ranked, iterations).and_then(|pose| self.judge.rmse_pr(&(self.to_clean * pose)));
                    let cell = cell(iterations, metric, *threshold_pr);
                    measured.push(Measured { cell, rmse_pr, share, microseconds });
                }
            }
        }
    }

    fn matches(&self) -> Vec<Correspondence> {
        let (config, resolution) = (self.config, self.resolution);
        let features = self.surfaces.map(|surface| {
            let keypoints = stages::detect(surface, config, resolution);
            let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
            stages::describe(surface, &points, config, resolution)
        });
        stages::match_features(&features, config)
    }

    /// Every metric at every threshold.
    fn ranks(&self) -> Vec<(f64, &MetricConfig, MetricConfig)> {
        let thresholds = &self.plan.thresholds_pr;
        let at = |metric| thresholds.iter().map(move |&t| (t, metric, at_threshold(metric, t)));
        self.plan.metrics.iter().flat_map(at).collect()
    }

    fn built(&self, metric: &MetricConfig) -> Box<dyn Metric + '_> {
        let clouds = Clouds { source: &self.surfaces.source, target: &self.surfaces.target };
        metric.build(self.resolution, clouds)
    }
}

/// The best pose among the first trials.
fn best(ranked: &[Hypothesis], iterations: u64) -> Option<RigidTransform> {
    ranked.iter().find(|h| h.trial < iterations).map(|h| h.target_from_source)
}

/// Mean time for one pose of the stream in the fastest round, microseconds.
fn time_of(metric: &dyn Metric, generator: &dyn HypothesisGenerator, evidence: &Evidence) -> Option<f64> {
    let poses: Vec<RigidTransform> =
        (0..generator.trials()).filter_map(|trial| generator.propose(trial)).take(TIMED_POSES).collect();
    let round = |_| {
        let start = Instant::now();
        for pose in &poses {
            black_box(metric.score(evidence, pose));
        }
        start.elapsed().as_secs_f64() * 1e6 / poses.len() as f64
    };
    // A round of a fast metric is shorter than an interruption by another process.
    (!poses.is_empty()).then(|| (0..TIMED_ROUNDS).map(round).fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Axis;
    use congruent_estimators::{EstimatorConfig, OnePointConfig, RansacConfig};
    use congruent_metrics::ThresholdConfig;
    use congruent_simulation::pair::{PairOptions, figurine_pair};

    fn plan() -> Plan {
        Plan {
            title: String::new(),
            notes: vec![],
            rows: Axis::Metric,
            columns: Axis::Estimator,
            variants: vec![],
            nuisances: vec![Nuisance::None {}, Nuisance::Noise(0.2)],
            estimators: vec![
                EstimatorConfig::Ransac(RansacConfig::default()),
                EstimatorConfig::OnePoint(OnePointConfig::default()),
            ],
            metrics: vec![
                MetricConfig::Mse(ThresholdConfig::default()),
                MetricConfig::InlierCount(ThresholdConfig::default()),
            ],
            thresholds_pr: vec![5.0, 7.5],
            iterations: vec![1, 1000],
            d_rmse: vec![2.5],
            measured_on: MeasuredOn::Scans,
            baseline: None,
            timed: true,
        }
    }

    #[test]
    fn every_cell_is_measured_and_many_hypotheses_beat_one() {
        let options = PairOptions { pixels: 150, view_angle: 0.3, ..PairOptions::default() };
        let pair = figurine_pair(&options);
        let scans = Pair { source: &pair.source, target: &pair.target };
        let variants = [("v".to_owned(), PipelineConfig::default())];
        let cells = run_pair(&plan(), &variants, scans, &pair.target_from_source).unwrap();
        assert_eq!(cells.len(), 2 * 2 * 2 * 2 * 2);
        let mse = |nuisance: &str, iterations| {
            let found = cells.iter().find(|m| {
                m.cell.nuisance == nuisance
                    && m.cell.iterations == iterations
                    && (m.cell.estimator, m.cell.metric, m.cell.threshold_pr) == ("RANSAC", "MSE", 7.5)
            });
            found.unwrap().clone()
        };
        // Also under noise, where the target's middle is another one.
        for nuisance in ["none", "noise 0.2 pr"] {
            let (one, all) = (mse(nuisance, 1), mse(nuisance, 1000));
            assert!(all.rmse_pr.unwrap() < 5.0 && all.share.ratio() > 0.1, "{nuisance}: {all:?}");
            assert!(one.rmse_pr.is_none_or(|rmse| rmse >= all.rmse_pr.unwrap()), "{one:?} {all:?}");
            assert!(all.microseconds.unwrap() > 0.0);
        }
    }

    #[test]
    fn a_pair_without_shared_surface_is_a_problem() {
        let pair = figurine_pair(&PairOptions { pixels: 60, ..PairOptions::default() });
        let scans = Pair { source: &pair.source, target: &pair.target };
        let away = RigidTransform::translation(1e4, 0.0, 0.0) * pair.target_from_source;
        let variants = [("v".to_owned(), PipelineConfig::default())];
        assert_eq!(run_pair(&plan(), &variants, scans, &away), Err(Problem::NotEvaluable { shared: 0 }));
    }
}
