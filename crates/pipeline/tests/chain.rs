//! The whole chain on simulated scans: right if possible, a reasoned failure otherwise, and always the same result.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_descriptors::{DescriptorConfig, LfshConfig, ShotConfig, SpinImageConfig};
use congruent_estimators::{EstimatorConfig, RansacConfig, TwoPointConfig};
use congruent_geometry::random::Stream;
use congruent_geometry::{
    Length, NeighborIndex, Orientation, RawScan, RigidTransform, Scan, mean_displacement, resolution,
};
use congruent_keypoints::{DetectorConfig, HarrisConfig, IssConfig, SupportFilter};
use congruent_matching::{MatcherConfig, RatioConfig};
use congruent_metrics::{MetricConfig, ThresholdConfig};
use congruent_pipeline::{
    AContrarioConfig, Failure, Guess, NeighborhoodConfig, NormalsConfig, Pair, PipelineConfig, PoolConfig,
    RankingConfig, Registration, SamplingConfig, Signs, Verdict, VerdictConfig, VoxelGridConfig, refine, register,
};
use congruent_refinement::RefinementConfig;
use congruent_simulation::benchmark::{Benchmark, GroupPair, Kind};
use congruent_simulation::nuisances::{add_noise, add_strays, moved, permuted, scaled};
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use congruent_simulation::scanner::{RangeNoise, VirtualScanner};
use congruent_simulation::shapes;
use nalgebra::{Point3, Translation3, Vector3};

/// Maximum error of a pose from three keypoints without refinement, pr.
const ROUGHLY: f64 = 6.0;

/// The paper's chain with few iterations: the simulated pair is easy.
fn paper() -> PipelineConfig {
    PipelineConfig {
        sampling: SamplingConfig::VoxelGrid(VoxelGridConfig::default()),
        normals: NormalsConfig {
            neighborhood: NeighborhoodConfig::Nearest(50),
            orientation: Orientation::Propagate {},
            ..NormalsConfig::default()
        },
        detector: DetectorConfig::Harris(HarrisConfig::default()),
        support: SupportFilter::default(),
        descriptor: DescriptorConfig::Shot(ShotConfig::default()),
        matcher: MatcherConfig::Ratio(RatioConfig::default()),
        estimator: EstimatorConfig::Ransac(RansacConfig::default()),
        pool: PoolConfig { poses: 1, optimisation_rounds: 0, ..PoolConfig::default() },
        ranking: RankingConfig::None {},
        refinement: RefinementConfig::None {},
        verdict: VerdictConfig::AContrario(AContrarioConfig::default()),
        quick: Vec::new(),
        escalation: Vec::new(),
        ..PipelineConfig::default()
    }
}

fn presets() -> [(&'static str, PipelineConfig); 2] {
    [("robust", PipelineConfig::default()), ("paper", paper())]
}

fn pair(view_angle_deg: f64) -> ScanPair {
    figurine_pair(&PairOptions {
        view_angle: f64::to_radians(view_angle_deg),
        pixels: 200,
        noise: RangeNoise::gaussian(0.05),
        ..PairOptions::default()
    })
}

fn run(source: &RawScan, target: &RawScan, config: &PipelineConfig) -> Registration {
    register(&Scan::new(source).unwrap(), &Scan::new(target).unwrap(), config)
}

/// Mean distance between the positions of the source under the answer and under the truth, in resolutions of the
/// source.
fn error_pr(answer: &RigidTransform, truth: &RigidTransform, source: &RawScan) -> f64 {
    let scan = Scan::new(source).unwrap();
    let pr = resolution(scan.points(), &NeighborIndex::new(scan.points())).unwrap().mean;
    let centre = RigidTransform::from_parts(Translation3::from(*scan.origin()), nalgebra::UnitQuaternion::identity());
    mean_displacement(scan.points(), &(answer * centre), &(truth * centre)) / pr
}

fn pose(registration: &Registration) -> RigidTransform {
    *registration.pose().unwrap()
}

#[test]
fn the_default_finds_the_pose_at_high_and_at_low_overlap() {
    for (angle, bound) in [(20.0, 0.5), (60.0, 0.5), (90.0, 1.5)] {
        let pair = pair(angle);
        let found = run(&pair.source, &pair.target, &PipelineConfig::default());
        let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
        assert!(
            found.verdict() == Verdict::Ok && error < bound,
            "{angle} degrees, overlap {:.2}: {error:.2} pr",
            pair.overlap
        );
    }
}

#[test]
fn many_strays_are_left_out_and_a_scan_without_any_stays_as_it_is() {
    let pair = pair(40.0);
    let clean = run(&pair.source, &pair.target, &PipelineConfig::default());
    assert_eq!(clean.counts.strays, Pair { source: 0, target: 0 });
    for share in [0.05, 0.4] {
        let [source, target] = [(&pair.source, 1), (&pair.target, 2)].map(|(scan, seed)| add_strays(scan, share, seed));
        let found = run(&source, &target, &PipelineConfig::default());
        let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
        assert!(found.verdict() == Verdict::Ok && error < 0.5, "{share}: {error:.2} pr, {:?}", found.outcome);
        let added = share * pair.source.points.len() as f64;
        let left_out = found.counts.strays.source as f64;
        assert!((0.8 * added..1.05 * added).contains(&left_out), "{left_out} of {added}");
    }
}

/// The attempt on few points is the one that is accepted, and the pose is as accurate as many points allow.
#[test]
fn noise_is_averaged_out_on_few_points() {
    let pair = pair(40.0);
    let scan = Scan::new(&pair.source).unwrap();
    let pr = resolution(scan.points(), &NeighborIndex::new(scan.points())).unwrap().mean;
    let [source, target] = [(&pair.source, 1), (&pair.target, 2)].map(|(scan, seed)| add_noise(scan, 2.5 * pr, seed));
    let config = PipelineConfig::default();
    let found = run(&source, &target, &config);
    let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
    assert!(found.verdict() == Verdict::Ok && error < 2.0, "{error:.2} pr, {:?}", found.outcome);
    let SamplingConfig::Budget(used) = &found.settings.config.sampling else { panic!("{:?}", found.settings) };
    assert_eq!(used.max_points, 2000, "the answer says which attempt it is of");
    let without = PipelineConfig {
        escalation: config.escalation.iter().filter(|step| step.max_points.is_none_or(|n| n > 2000)).cloned().collect(),
        ..config
    };
    assert_ne!(run(&source, &target, &without).verdict(), Verdict::Ok, "few points are not needed here");
}

/// A closed model has no viewpoint to which its normals could be turned. The first attempt gets their side right, so
/// the last step, which turns them, is not needed.
#[test]
fn a_whole_model_is_found_in_a_scan() {
    let config = PipelineConfig { escalation: Vec::new(), ..PipelineConfig::default() };
    for seed in 1..=2 {
        let mesh = shapes::figurine(seed);
        let scanner = VirtualScanner::orbit(&mesh, 1.5 * seed as f64, 0.3, 3.0, 200);
        let (scan, truth) = (scanner.scan(&mesh, seed).cloud(), scanner.world_from_sensor.inverse());
        let model = mesh.into_raw();
        let found = run(&model, &scan, &config);
        let error = error_pr(&pose(&found), &truth, &model);
        assert!(found.verdict() == Verdict::Ok && error < 0.5, "{seed}: {error:.2} pr, {:?}", found.outcome);
        let back = run(&scan, &model, &config);
        let error = error_pr(&pose(&back), &truth.inverse(), &scan);
        assert!(back.verdict() == Verdict::Ok && error < 0.5, "{seed}, back: {error:.2} pr, {:?}", back.outcome);
    }
}

/// In an image of several objects on a table, a wrong pose may touch more than the right one, which has a higher
/// confidence.
#[test]
fn what_is_believed_most_wins_over_what_touches_most() {
    let group = Benchmark::new(Kind::Bod5, 11).group(7);
    let of_model = |pair: &&GroupPair| group.scans[pair.source].0.starts_with("model0");
    let pair = group.pairs.iter().find(of_model).unwrap();
    let [source, target] = [pair.source, pair.target].map(|at| &group.scans[at].1);
    let config = PipelineConfig { escalation: Vec::new(), ..PipelineConfig::default() };
    let found = run(source, target, &config);
    let error = error_pr(&pose(&found), &pair.target_from_source, source);
    assert!(found.verdict() == Verdict::Ok && error < 1.0, "{error:.2} pr, {:?}", found.outcome);
}

#[test]
fn the_papers_chain_finds_the_pose_roughly() {
    let pair = pair(20.0);
    let found = run(&pair.source, &pair.target, &paper());
    let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
    assert!(found.verdict() == Verdict::Ok && error < ROUGHLY, "{error:.2} pr");
}

#[test]
fn every_metric_runs_in_the_papers_chain() {
    let pair = pair(20.0);
    let threshold = ThresholdConfig::default;
    for metric in [
        MetricConfig::Mae(threshold()),
        MetricConfig::LogCosh(threshold()),
        MetricConfig::Exp(threshold()),
        MetricConfig::Quantile(Default::default()),
        MetricConfig::NegQuantile(Default::default()),
        MetricConfig::InlierCount(threshold()),
        MetricConfig::Huber(threshold()),
    ] {
        let found = run(&pair.source, &pair.target, &PipelineConfig { metric: metric.clone(), ..paper() });
        let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
        assert!(error < 15.0, "{metric:?}: {error:.2} pr");
    }
}

/// C1 to C6 of the paper: two detectors, three descriptors.
#[test]
fn every_detector_and_descriptor_registers_the_simulated_pair() {
    let pair = pair(15.0);
    let detectors = [DetectorConfig::Harris(HarrisConfig::default()), DetectorConfig::Iss(IssConfig::default())];
    let descriptors = [
        DescriptorConfig::Shot(ShotConfig::default()),
        DescriptorConfig::SpinImage(SpinImageConfig::default()),
        DescriptorConfig::Lfsh(LfshConfig::default()),
    ];
    for (detector, descriptor) in detectors.iter().flat_map(|d| descriptors.iter().map(move |e| (d, e))) {
        let config = PipelineConfig {
            detector: detector.clone(),
            descriptor: descriptor.clone(),
            estimator: EstimatorConfig::TwoPoint(TwoPointConfig { iterations: 5000, ..TwoPointConfig::default() }),
            ..paper()
        };
        let found = run(&pair.source, &pair.target, &config);
        let error = error_pr(&pose(&found), &pair.target_from_source, &pair.source);
        // Spin images and LFSH discriminate little; it is enough that the pose is found at all.
        assert!(error < 8.0, "{detector:?}, {descriptor:?}: {error:.2} pr, {} inliers", found.counts.inliers);
    }
}

#[test]
fn threads_do_not_matter() {
    let pair = pair(50.0);
    for (name, config) in presets() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found = pool.install(|| run(&pair.source, &pair.target, &config));
            (
                found.pose().copied(),
                found.estimate().map(|found| found.score),
                found.confidence(),
                found.counts,
                found.fit().copied(),
            )
        };
        let one = on(1);
        assert!(one == on(2) && one == on(4), "{name}");
    }
}

#[test]
fn the_order_of_the_points_does_not_matter() {
    let pair = pair(40.0);
    for (name, config) in presets() {
        let plain = run(&pair.source, &pair.target, &config);
        let mixed = run(&permuted(&pair.source, 5), &permuted(&pair.target, 6), &config);
        let difference = error_pr(&pose(&mixed), &pose(&plain), &pair.source);
        // The resolution is a mean over the points in their order, so its last bits may differ.
        assert!(difference < 0.05, "{name}: {difference} pr");
    }
}

#[test]
fn units_do_not_matter() {
    let pair = pair(40.0);
    for (name, config) in presets() {
        let plain = pose(&run(&pair.source, &pair.target, &config));
        for factor in [1e-3, 1024.0] {
            let found = pose(&run(&scaled(&pair.source, factor), &scaled(&pair.target, factor), &config));
            let back =
                RigidTransform::from_parts(Translation3::from(found.translation.vector / factor), found.rotation);
            // Rounding moves a few points across the border of a cell; the paper's chain then draws other samples, and
            // finds another pose that is roughly right.
            let draws_anew = name == "paper" && factor != 1024.0;
            let (expected, bound) = if draws_anew { (&pair.target_from_source, ROUGHLY) } else { (&plain, 0.1) };
            let difference = error_pr(&back, expected, &pair.source);
            assert!(difference < bound, "{name}, times {factor}: {difference} pr");
        }
    }
}

#[test]
fn geographic_coordinates_do_not_matter() {
    let pair = pair(40.0);
    let (there, elsewhere) =
        (RigidTransform::translation(1e6, -2e6, 500.0), RigidTransform::translation(-3e6, 1e6, 0.0));
    for (name, config) in presets() {
        let plain = pose(&run(&pair.source, &pair.target, &config));
        let found = pose(&run(&moved(&pair.source, &there), &moved(&pair.target, &elsewhere), &config));
        let back = elsewhere.inverse() * found * there;
        let difference = error_pr(&back, &plain, &pair.source);
        assert!(difference < 0.1, "{name}: {difference} pr");
    }
}

#[test]
fn any_motion_of_the_scans_comes_back() {
    let mut stream = Stream::new(3, 0);
    let pair = pair(40.0);
    let mut motion = || {
        RigidTransform::from_parts(Translation3::new(300.0, -40.0, stream.between(-500.0, 500.0)), stream.rotation())
    };
    for _ in 0..3 {
        let (a, b) = (motion(), motion());
        let turned = pair.moved(&a, &b);
        let found = run(&turned.source, &turned.target, &PipelineConfig::default());
        let error = error_pr(&pose(&found), &turned.target_from_source, &turned.source);
        assert!(found.verdict() == Verdict::Ok && error < 0.5, "{error} pr");
    }
}

/// Noisy range scans of a mesh from two sides.
fn two_looks(mesh: &congruent_simulation::Mesh) -> (RawScan, RawScan) {
    let look = |azimuth: f64, seed: u64| {
        let scanner = VirtualScanner::orbit(mesh, azimuth, 0.4, 3.0, 120);
        VirtualScanner { noise: RangeNoise::gaussian(0.02), ..scanner }.scan(mesh, seed).cloud()
    };
    (look(0.0, 1), look(0.6, 2))
}

#[test]
fn what_slides_on_itself_fails_with_a_reason() {
    let shapes = [
        ("plane", shapes::plane(100.0, 2)),
        ("sphere", shapes::sphere(50.0, 5)),
        ("cylinder", shapes::cylinder(20.0, 400.0, 90)),
    ];
    for ((name, mesh), (preset, config)) in shapes.iter().flat_map(|shape| presets().map(|preset| (shape, preset))) {
        let (source, target) = two_looks(mesh);
        let found = run(&source, &target, &config);
        let Some(reason) = found.failure() else { panic!("{name}, {preset}: {found:?}") };
        assert!(!reason.to_string().is_empty());
        if let Some(&pose) = found.pose() {
            assert!((pose * Point3::from(Vector3::x())).iter().all(|v| v.is_finite()), "{name}");
        }
    }
}

#[test]
fn a_box_fits_in_more_than_one_way() {
    let mesh = shapes::cuboid(Vector3::new(60.0, 40.0, 25.0).into());
    let all_around = |seed: u64| {
        let looks = [0.3, 2.4, 4.5].iter().flat_map(|&azimuth| {
            [-0.7, 0.7].map(|elevation| {
                let scanner = VirtualScanner::orbit(&mesh, azimuth, elevation, 3.0, 120);
                let scan = VirtualScanner { noise: RangeNoise::gaussian(0.02), ..scanner }.scan(&mesh, seed);
                moved(&scan.cloud(), &scan.world_from_sensor)
            })
        });
        RawScan { points: looks.flat_map(|scan| scan.points).collect(), ..RawScan::default() }
    };
    let (source, target) = (all_around(1), all_around(2));
    let found = run(&source, &target, &PipelineConfig::default());
    assert_eq!(found.verdict(), Verdict::Ambiguous, "{found:?}");
    assert!(!found.alternatives().is_empty());
    // An initial guess determines which of the poses is meant.
    let scans = [&source, &target].map(|scan| Scan::new(scan).unwrap());
    let guess = Guess::new(RigidTransform::identity());
    let refined = refine(&scans[0], &scans[1], &guess, &PipelineConfig::default());
    assert_eq!(refined.verdict(), Verdict::Ok, "{refined:?}");
}

/// A relief that is nearly its own image when turned face down, with noise in all directions.
fn noisy_relief(stream: &mut Stream, noise: f64) -> RawScan {
    let bump =
        |x: f64, y: f64, at: [f64; 2], narrow: f64| (-narrow * ((x - at[0]).powi(2) + (y - at[1]).powi(2))).exp();
    let height = |x: f64, y: f64| {
        0.3 * (3.0 * x).sin() * (2.0 * y).cos()
            + 0.2 * bump(x, y, [0.4, -0.2], 8.0)
            + 0.15 * bump(x, y, [-0.5, 0.5], 20.0)
    };
    let mut point = || {
        let [x, y] = [(); 2].map(|()| stream.between(-1.0, 1.0));
        [x, y, height(x, y)].map(|v| v + noise * stream.normal())
    };
    RawScan { points: (0..30_000).map(|_| point()).collect(), ..RawScan::default() }
}

#[test]
fn an_unsure_side_is_heard_before_a_pose_is_believed() {
    let mut stream = Stream::new(4, 0);
    let [source, target] = [(); 2].map(|()| noisy_relief(&mut stream, 0.03));
    let found = run(&source, &target, &PipelineConfig::default());
    let error = error_pr(&pose(&found), &RigidTransform::identity(), &source);
    assert_eq!((found.verdict(), found.settings.signs), (Verdict::Ok, Signs::Other));
    assert!(error < 2.5, "{error}");
}

/// Three walls of one box fit those of another, with almost no distance between them.
#[test]
fn corners_of_different_boxes_are_not_the_same() {
    let corner = |size: [f64; 3], seed: u64| {
        let cuboid = shapes::cuboid(size);
        let scanner = VirtualScanner::orbit(&cuboid, 0.7, 0.5, 3.0, 150);
        VirtualScanner { noise: RangeNoise::gaussian(0.005), ..scanner }.scan(&cuboid, seed).cloud()
    };
    for (source, target) in [([4.0, 3.0, 2.0], [5.0, 3.3, 2.6]), ([4.0, 3.0, 2.0], [3.5, 4.5, 2.5])] {
        let found = run(&corner(source, 1), &corner(target, 2), &PipelineConfig::default());
        assert_ne!(found.verdict(), Verdict::Ok, "{source:?} {target:?}");
    }
}

#[test]
fn scans_too_small_to_register_fail_with_a_reason() {
    let tiny = RawScan { points: vec![[0.0f64; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(), ..RawScan::default() };
    let line = RawScan { points: (0..500).map(|i| [f64::from(i), 0.0, 0.0]).collect(), ..RawScan::default() };
    let coarse =
        PipelineConfig { sampling: SamplingConfig::VoxelGrid(VoxelGridConfig { leaf: Length::Units(1e6) }), ..paper() };
    for (scan, config) in [
        (&tiny, paper()),
        (&tiny, PipelineConfig::default()),
        (&line, paper()),
        (&line, PipelineConfig::default()),
        (&line, coarse),
    ] {
        let found = run(scan, scan, &config);
        assert!(found.verdict() == Verdict::Failed, "{found:?}");
        assert!(found.confidence().is_finite() && (0.0..=1.0).contains(&found.confidence()));
    }
    let found = run(
        &line,
        &line,
        &PipelineConfig { support: SupportFilter { min_points: usize::MAX, ..SupportFilter::default() }, ..paper() },
    );
    assert_eq!(found.failure(), Some(&Failure::FewKeypoints { found: Pair { source: 0, target: 0 } }));
}

#[test]
fn metres_and_millimetres_are_told_apart() {
    let pair = pair(30.0);
    let [source, target] = [scaled(&pair.source, 1e-3), pair.target].map(|raw| Scan::new(&raw).unwrap());
    for (name, config) in presets() {
        let found = register(&source, &target, &config);
        assert!(matches!(found.failure(), Some(Failure::OtherUnits { .. })), "{name}: {:?}", found.outcome);
    }
}
