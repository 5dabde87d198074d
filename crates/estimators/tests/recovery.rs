//! Every estimator with every metric finds a known pose, forwards and backwards, among as many wrong pairs as right
//! ones.

use congruent_estimators::{EstimatorConfig, sample_all};
use congruent_geometry::random::Stream;
use congruent_geometry::{NeighborIndex, Point, RigidTransform, Surface, mean_displacement};
use congruent_metrics::{Clouds, Evidence, Metric, MetricConfig};
use congruent_simulation::correspondences::{CorrespondenceScene, Correspondences, NearMiss, PairKind};
use nalgebra::{Matrix3, Vector3};

/// The paper's limit for a right pose, in pr. Right pairs are off by 2.6 pr (root mean square); the inlier count, which
/// does not distinguish a loose inlier from a tight one, comes closest to the limit.
const MAX_DISPLACEMENT: f64 = 2.5;
/// Error of the frames of right pairs: a rotation by this angle about a random axis, degrees.
const FRAME_ERROR_DEG: f64 = 1.0;

/// Number of points of each cloud: dense metrics are slow.
const N_SURFACE: usize = 300;

const ESTIMATORS: [&str; 11] = [
    "[ransac]\niterations = 400",
    "[ransac]\niterations = 400\nedge-similarity = 0.8\nmin-spread = \"15pr\"",
    "[ransac]\niterations = 400\norder = \"prosac\"",
    "[ransac]\niterations = 400\n[ransac.adaptive-stop]\nconfidence = 0.9999999",
    "[two-point]\niterations = 400",
    "[one-point]",
    "[sac-ia]\niterations = 400",
    "[pivots]\npivots = 150",
    "[pivots]\npivots = 150\n[pivots.graph]\npruning = \"core\"",
    "[seeds]",
    "[cliques]",
];

const METRICS: [&str; 16] = [
    "[inlier-count]",
    "[mae]",
    "[mse]",
    "[log-cosh]",
    "[exp]",
    "[quantile]",
    "[neg-quantile]",
    "[huber]",
    "[msac]",
    "[magsac]",
    "[sac-ia]",
    "[point-distance]",
    "[point-distance]\nreading = \"literal\"\nclouds = \"full\"",
    "[overlapped-points]\nthreshold = \"3pr\"",
    "[overlapped-points]\nthreshold = \"3pr\"\nclouds = \"full\"",
    "[soft-overlap]",
];

/// Two clouds, pairs with frames, and the true pose.
struct Case {
    source: Surface,
    target: Surface,
    evidence: Evidence,
    truth: RigidTransform,
}

impl Case {
    fn forwards() -> Case {
        let scene =
            CorrespondenceScene { n: 300, inlier_share: 0.5, near_miss_share: 0.0, near_miss: NearMiss::Random };
        let pairs = scene.generate(1);
        let moved = |p: &Point| {
            let p = nalgebra::Point3::from(congruent_geometry::wide(*p));
            congruent_geometry::narrow(&(pairs.truth * p).coords)
        };
        let evidence = Evidence::new(pairs.source.iter().copied().zip(pairs.target.iter().copied()));
        Case {
            source: surface(pairs.surface[..N_SURFACE].to_vec()),
            target: surface(pairs.surface[..N_SURFACE].iter().map(moved).collect()),
            evidence: evidence.with_frames(frames(&pairs)),
            truth: pairs.truth,
        }
    }

    fn backwards(self) -> Case {
        let e = &self.evidence;
        let swapped = Evidence::new(
            (0..e.len()).map(|i| (congruent_geometry::narrow(&e.target(i)), congruent_geometry::narrow(&e.source(i)))),
        );
        let frames = (0..e.len()).map(|i| e.frames(i).map(|(p, q)| (q, p))).collect();
        Case {
            evidence: swapped.with_frames(frames),
            source: self.target,
            target: self.source,
            truth: self.truth.inverse(),
        }
    }
}

fn surface(points: Vec<Point>) -> Surface {
    let index = NeighborIndex::new(&points);
    let normals = vec![[0.0, 0.0, 1.0]; points.len()];
    Surface::new(points, normals, index, 1.0)
}

/// Frames that follow the truth up to a small rotation at right pairs, and arbitrary ones elsewhere.
fn frames(pairs: &Correspondences) -> Vec<Option<(Matrix3<f64>, Matrix3<f64>)>> {
    let truth = pairs.truth.rotation.to_rotation_matrix();
    let frame = |(i, kind): (u64, &PairKind)| {
        let mut stream = Stream::new(99, i);
        let source = *stream.rotation().to_rotation_matrix().matrix();
        let error = Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize();
        let turn = nalgebra::Rotation3::new(error * FRAME_ERROR_DEG.to_radians());
        let target = match kind {
            PairKind::Inlier => source * truth.matrix().transpose() * turn.matrix(),
            _ => *stream.rotation().to_rotation_matrix().matrix(),
        };
        Some((source, target))
    };
    (0..).zip(&pairs.kinds).map(frame).collect()
}

fn parsed<C: serde::de::DeserializeOwned>(text: &str) -> C {
    toml::from_str(text).expect("the tables above are valid")
}

fn check(case: &Case, direction: &str) {
    let clouds = Clouds { source: &case.source, target: &case.target };
    let metrics: Vec<Box<dyn Metric>> =
        METRICS.iter().map(|text| parsed::<MetricConfig>(text).build(1.0, clouds)).collect();
    let metrics: Vec<&dyn Metric> = metrics.iter().map(AsRef::as_ref).collect();
    for estimator in ESTIMATORS {
        let config = parsed::<EstimatorConfig>(estimator);
        let generator = config.build(&case.evidence, 1.0, 7);
        for (best, metric) in sample_all(generator.as_ref(), &metrics, &case.evidence, 1).iter().zip(METRICS) {
            let error = mean_displacement(case.source.points(), &best[0].target_from_source, &case.truth);
            assert!(error < MAX_DISPLACEMENT, "{direction}: {estimator} with {metric}: {error}");
        }
    }
}

#[test]
fn all_estimators_with_all_metrics_recover_the_pose() {
    let case = Case::forwards();
    check(&case, "forwards");
    check(&case.backwards(), "backwards");
}

#[test]
fn estimators_that_need_frames_propose_nothing_without_them() {
    let case = Case::forwards();
    let bare = case.evidence.clone().with_frames(vec![None; case.evidence.len()]);
    for estimator in ESTIMATORS {
        let config = parsed::<EstimatorConfig>(estimator);
        let generator = config.build(&bare, 1.0, 7);
        let proposes = (0..generator.trials().min(5)).any(|trial| generator.propose(trial).is_some());
        assert_eq!(proposes, !config.needs_frames(), "{estimator}");
    }
}

#[test]
fn neither_threads_nor_the_order_of_trials_matter() {
    let case = Case::forwards();
    for estimator in ESTIMATORS {
        let config = parsed::<EstimatorConfig>(estimator);
        let poses = |threads, backwards: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let generator = pool.install(|| config.build(&case.evidence, 1.0, 7));
            let trials = 0..generator.trials();
            let mut poses: Vec<_> = if backwards {
                trials.rev().map(|trial| generator.propose(trial)).collect()
            } else {
                trials.map(|trial| generator.propose(trial)).collect()
            };
            if backwards {
                poses.reverse();
            }
            poses
        };
        assert_eq!(poses(1, false), poses(4, true), "{estimator}");
    }
}

#[test]
fn fewer_than_three_correspondences_or_all_alike_propose_nothing() {
    let pair = |i: usize| ([i as f32 * 20.0, 0.0, 0.0], [0.0, i as f32 * 20.0, 0.0]);
    let few = (0..3).map(|n| Evidence::new((0..n).map(pair)));
    for evidence in few.chain([Evidence::new((0..50).map(|_| pair(1)))]) {
        for estimator in ESTIMATORS {
            let generator = parsed::<EstimatorConfig>(estimator).build(&evidence, 1.0, 7);
            let proposes = (0..generator.trials().min(5)).any(|trial| generator.propose(trial).is_some());
            assert!(!proposes, "{estimator} with {}", evidence.len());
        }
    }
}

#[test]
fn threads_do_not_matter_where_sampling_stops_early() {
    let case = Case::forwards();
    let clouds = Clouds { source: &case.source, target: &case.target };
    let metric = MetricConfig::default().build(1.0, clouds);
    let text = "[ransac]\niterations = 100000\nedge-similarity = 0.8\norder = \"prosac\"\n[ransac.adaptive-stop]";
    let config = parsed::<EstimatorConfig>(text);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let generator = config.build(&case.evidence, 1.0, 3);
        let found =
            pool.install(|| sample_all(generator.as_ref(), &[metric.as_ref()], &case.evidence, 100_000)).remove(0);
        found.iter().map(|h| (h.trial, h.score, h.target_from_source)).collect::<Vec<_>>()
    };
    let one = run(1);
    assert!(one.len() <= 1024, "it stopped after {} trials", one.len());
    assert_eq!(one, run(4));
}
