//! What sets the metrics apart: wrong pairs that agree with a motion near the true one.
//!
//! With wrong pairs anywhere on the surface most metrics do alike. With coherent near misses the inlier count and EXP,
//! which do not care how loose an inlier is, follow the wrong motion.

use congruent_estimators::{ThreePoint, sample_all};
use congruent_geometry::mean_displacement;
use congruent_metrics::{Evidence, Exp, InlierCount, LogCosh, Mae, Metric, Mse, Summed};
use congruent_simulation::correspondences::{CorrespondenceScene, NearMiss};
use rayon::prelude::*;

/// Enough that chance moves an accuracy by less than a point.
const TRIALS: u64 = 3000;
const HYPOTHESES: u64 = 1000;
/// Inlier threshold, pr.
const THRESHOLD: f64 = 7.5;
/// A pose is right if it puts the surface within this of the truth on average, pr.
const MAX_DISPLACEMENT: f64 = 2.5;
/// The expected accuracies come from an independent program: 150 to 200 trials (a standard error of up to 3.5 points) on
/// scenes of the same recipe.
const REFERENCE: f64 = 0.08;
/// Metrics that do alike may swap places by this much.
const CHANCE: f64 = 0.01;

/// MSE, LOG-COSH, MAE, EXP, inlier count.
type Accuracies = [f64; 5];

fn accuracies(scene: &CorrespondenceScene) -> Accuracies {
    let metrics: [&dyn Metric; 5] = [
        &Summed(Mse::new(THRESHOLD)),
        &Summed(LogCosh::new(THRESHOLD, 1.0)),
        &Summed(Mae::new(THRESHOLD)),
        &Summed(Exp::new(THRESHOLD)),
        &Summed(InlierCount::new(THRESHOLD)),
    ];
    let is_right = |seed: u64| -> [u32; 5] {
        let pairs = scene.generate(seed);
        let evidence = Evidence::new(pairs.source.iter().copied().zip(pairs.target.iter().copied()));
        let ranked = sample_all(&ThreePoint::new(&evidence, HYPOTHESES, seed), &metrics, &evidence, 1);
        let error = |pose| mean_displacement(&pairs.surface, pose, &pairs.truth);
        std::array::from_fn(|metric| u32::from(error(&ranked[metric][0].target_from_source) < MAX_DISPLACEMENT))
    };
    let trials: Vec<[u32; 5]> = (0..TRIALS).into_par_iter().map(is_right).collect();
    let right: [u32; 5] = std::array::from_fn(|metric| trials.iter().map(|trial| trial[metric]).sum());
    right.map(|n| f64::from(n) / TRIALS as f64)
}

fn scene(inlier_share: f64, near_miss_share: f64) -> CorrespondenceScene {
    CorrespondenceScene { n: 300, inlier_share, near_miss_share, near_miss: NearMiss::Coherent }
}

fn check(scene: &CorrespondenceScene, expected: Accuracies) {
    let found = accuracies(scene);
    let close = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= REFERENCE);
    assert!(close, "{scene:?}: {found:?}, expected {expected:?}");
    let ordered = found.windows(2).all(|pair| pair[0] >= pair[1] - CHANCE);
    assert!(ordered, "{scene:?}: {found:?} should fall from MSE to the inlier count");
}

#[test]
fn metrics_differ_where_wrong_pairs_agree() {
    check(&scene(0.2, 0.0), [0.95, 0.95, 0.95, 0.95, 0.79]);
    check(&scene(0.15, 0.3), [0.90, 0.81, 0.77, 0.17, 0.05]);
    check(&scene(0.3, 0.4), [1.0, 1.0, 1.0, 0.42, 0.11]);
}
