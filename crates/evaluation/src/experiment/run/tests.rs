//! Tests of experiments on a simulated pair.

use super::*;
use crate::experiment::Axis;
use congruent_estimators::{EstimatorConfig, OnePointConfig, PivotsConfig, RansacConfig};
use congruent_metrics::{PointDistanceConfig, ThresholdConfig};
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};

fn plan() -> Plan {
    Plan {
        title: String::new(),
        notes: vec![],
        shows: Shows::Accuracy,
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
    }
}

fn pair(pixels: u32) -> ScanPair {
    figurine_pair(&PairOptions { pixels, view_angle: 0.3, ..PairOptions::default() })
}

fn run(plans: &[Plan], pair: &ScanPair) -> Result<Vec<Vec<Measured>>, Problem> {
    let variants = [("v".to_owned(), PipelineConfig::default())];
    let requests: Vec<Request<'_>> = plans.iter().map(|plan| Request { plan, variants: &variants }).collect();
    run_pair(&requests, Pair { source: &pair.source, target: &pair.target }, &pair.target_from_source)
}

#[test]
fn every_cell_is_measured_and_many_hypotheses_beat_one() {
    let cells = run(&[plan()], &pair(150)).unwrap().remove(0);
    assert_eq!(cells.len(), 2 * 2 * 2 * 2 * 2);
    let mse = |nuisance: &str, iterations| {
        let found = cells.iter().find(|m| {
            m.cell.nuisance == nuisance
                && m.cell.iterations == iterations
                && (&*m.cell.estimator, &*m.cell.metric, m.cell.threshold_pr) == ("RANSAC", "MSE", 7.5)
        });
        found.unwrap().clone()
    };
    // Also under noise, where the centre of the target is a different one.
    for nuisance in ["none", "noise 0.2 pr"] {
        let (one, all) = (mse(nuisance, 1), mse(nuisance, 1000));
        assert!(all.rmse_pr.unwrap() < 5.0 && all.share.ratio() > 0.1, "{nuisance}: {all:?}");
        assert!(one.rmse_pr.is_none_or(|rmse| rmse >= all.rmse_pr.unwrap()), "{one:?} {all:?}");
    }
}

#[test]
fn together_or_one_by_one_plans_find_the_same() {
    let plans = [
        plan(),
        Plan { iterations: vec![10, 400, 1000], thresholds_pr: vec![7.5, 9.0], ..plan() },
        Plan {
            estimators: plan().estimators[..1].to_vec(),
            metrics: vec![MetricConfig::PointDistance(PointDistanceConfig::default())],
            iterations: vec![300],
            ..plan()
        },
        Plan { shows: Shows::Inliers, metrics: vec![], ..plan() },
    ];
    let pair = pair(110);
    let together = run(&plans, &pair).unwrap();
    for (plan, shared) in plans.iter().zip(&together) {
        assert_eq!(&run(std::slice::from_ref(plan), &pair).unwrap()[0], shared);
        assert!(shared.iter().all(|m| m.share.matches > 20 && m.microseconds.is_none()));
    }
    assert_eq!(together[3].len(), 2 * 2);
}

#[test]
fn one_bound_of_iterations_excludes_later_trials_of_every_estimator() {
    let estimators = vec![EstimatorConfig::Pivots(PivotsConfig::default())];
    let plan = |iterations: Vec<u64>| Plan { estimators: estimators.clone(), iterations, ..plan() };
    let pair = pair(110);
    let of_20 = |plan: Plan| {
        let found = run(&[plan], &pair).unwrap().remove(0);
        found.into_iter().filter(|m| m.cell.iterations == 20).map(|m| m.rmse_pr).collect::<Vec<_>>()
    };
    let alone = of_20(plan(vec![20]));
    assert!(alone.len() == 8 && alone.iter().all(Option::is_some), "{alone:?}");
    assert_eq!(alone, of_20(plan(vec![20, 100_000])));
}

#[test]
fn times_are_taken_of_every_metric_and_nothing_is_ranked() {
    let timed = Plan { shows: Shows::Time, iterations: vec![20], nuisances: vec![Nuisance::None {}], ..plan() };
    let found = run(&[plan(), timed], &pair(110)).unwrap();
    assert_eq!(found[1].len(), 2 * 2 * 2);
    for measured in &found[1] {
        assert!(measured.microseconds.unwrap() > 0.0 && measured.rmse_pr.is_none(), "{measured:?}");
    }
}

#[test]
fn a_pair_without_shared_surface_is_a_problem() {
    let pair = pair(60);
    let away = RigidTransform::translation(1e4, 0.0, 0.0) * pair.target_from_source;
    let away = ScanPair { target_from_source: away, ..pair };
    assert_eq!(run(&[plan()], &away), Err(Problem::NotEvaluable { shared: 0 }));
}
