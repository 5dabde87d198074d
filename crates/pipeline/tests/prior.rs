//! The effects of a prior: guesses compete, bounds hold, levelled scans stay level, and a start can be refined without
//! a search.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::{Length, RawScan, RigidTransform, Scan, angle_between, mean_displacement};
use congruent_pipeline::{Failure, Guess, PipelineConfig, Prior, Registration, Verdict, refine, register_within};
use congruent_simulation::nuisances::moved;
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use congruent_simulation::scanner::{RangeNoise, VirtualScanner, look_at};
use congruent_simulation::shapes;
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};

fn run(source: &RawScan, target: &RawScan, prior: &Prior) -> Registration {
    run_with(source, target, prior, &PipelineConfig::default())
}

/// Without the escalation, for pairs that no attempt would register.
fn run_once(source: &RawScan, target: &RawScan, prior: &Prior) -> Registration {
    run_with(source, target, prior, &PipelineConfig { escalation: Vec::new(), ..PipelineConfig::default() })
}

fn run_with(source: &RawScan, target: &RawScan, prior: &Prior, config: &PipelineConfig) -> Registration {
    let (source, target) = (Scan::new(source).unwrap(), Scan::new(target).unwrap());
    register_within(&source, &target, prior, config)
}

fn guess(target_from_source: RigidTransform, degrees: f64, translation: Length) -> Prior {
    let guess =
        Guess { target_from_source, max_rotation: Some(degrees.to_radians()), max_translation: Some(translation) };
    Prior { guess: Some(guess), up: None }
}

fn figurine() -> ScanPair {
    figurine_pair(&PairOptions { pixels: 150, noise: RangeNoise::gaussian(0.05), ..PairOptions::default() })
}

/// A motion in the target's frame that moves points there by a few units.
fn nudge() -> RigidTransform {
    RigidTransform::new(Vector3::new(2.0, -1.0, 1.5), Vector3::new(0.01, 0.0, -0.01))
}

fn error(found: &Registration, truth: &RigidTransform, source: &RawScan) -> f64 {
    let scan = Scan::new(source).unwrap();
    let centre = RigidTransform::from_parts(Translation3::from(*scan.origin()), UnitQuaternion::identity());
    mean_displacement(scan.points(), &(found.pose().unwrap() * centre), &(truth * centre)) / found.raw_resolution
}

/// A box, scanned from all sides.
fn cuboid(seed: u64) -> RawScan {
    let mesh = shapes::cuboid(Vector3::new(60.0, 40.0, 25.0).into());
    let looks = [0.3, 2.4, 4.5].iter().flat_map(|&azimuth| {
        [-0.7, 0.7].map(|elevation| {
            let scanner = VirtualScanner::orbit(&mesh, azimuth, elevation, 3.0, 100);
            let scan = VirtualScanner { noise: RangeNoise::gaussian(0.02), ..scanner }.scan(&mesh, seed);
            moved(&scan.cloud(), &scan.world_from_sensor)
        })
    });
    RawScan { points: looks.flat_map(|scan| scan.points).collect(), ..RawScan::default() }
}

#[test]
fn a_guess_tells_the_sides_of_a_box_apart() {
    let (source, target) = (cuboid(1), cuboid(2));
    assert_eq!(run(&source, &target, &Prior::default()).verdict(), Verdict::Ambiguous);
    // Each of two poses that fit equally well is the answer if the guess is near it.
    for turn in [0.0, std::f64::consts::PI] {
        let truth = RigidTransform::rotation(Vector3::z() * turn);
        let rough = RigidTransform::new(Vector3::new(2.0, 1.0, -1.0), Vector3::new(0.03, -0.05, 0.08)) * truth;
        let found = run(&source, &target, &guess(rough, 20.0, Length::Units(10.0)));
        assert!(found.verdict() == Verdict::Ok && error(&found, &truth, &source) < 1.0, "{turn} {:?}", found.outcome);
    }
}

#[test]
fn bounds_that_exclude_the_truth_fail_and_say_so() {
    let pair = figurine();
    let wrong = RigidTransform::rotation(Vector3::new(0.0, 1.5, 0.0)) * pair.target_from_source;
    let found = run_once(&pair.source, &pair.target, &guess(wrong, 10.0, Length::Units(20.0)));
    let Some(failure @ Failure::OutOfBounds { .. }) = found.failure() else { panic!("{:?}", found.outcome) };
    assert!(failure.to_string().contains("within the bounds"));
    assert!(angle_between(found.pose().unwrap(), &wrong) <= 10f64.to_radians() + 1e-9);
}

#[test]
fn a_bound_in_resolutions_is_the_same_length_in_every_attempt() {
    let pair = figurine();
    let shift = |resolutions: f64, pr: f64| RigidTransform::translation(resolutions * pr, 0.0, 0.0);
    let pr = run(&pair.source, &pair.target, &Prior::default()).raw_resolution;
    let bounded = |resolutions: f64| {
        let off = shift(resolutions, pr) * pair.target_from_source;
        run(&pair.source, &pair.target, &guess(off, 10.0, Length::Resolutions(6.0)))
    };
    assert_eq!(bounded(5.5).verdict(), Verdict::Ok);
    // Within six times the distance of the points after sampling, but not of those of the scans.
    let beyond = bounded(7.0);
    assert!(matches!(beyond.failure(), Some(Failure::OutOfBounds { .. })), "{:?}", beyond.outcome);
}

#[test]
fn a_good_guess_changes_nothing_and_a_bad_one_does_no_harm() {
    let pair = figurine();
    for start in [nudge() * pair.target_from_source, RigidTransform::rotation(Vector3::y() * 2.0)] {
        let found = run(&pair.source, &pair.target, &Prior::guess(start));
        let error = error(&found, &pair.target_from_source, &pair.source);
        assert!(found.verdict() == Verdict::Ok && error < 0.3, "{error} {:?}", found.outcome);
    }
}

#[test]
fn a_rough_pose_is_refined_and_a_wrong_one_is_not_believed() {
    let pair = figurine();
    let (source, target) = (Scan::new(&pair.source).unwrap(), Scan::new(&pair.target).unwrap());
    let refined = |start: RigidTransform| refine(&source, &target, &Guess::new(start), &PipelineConfig::default());
    let found = refined(nudge() * pair.target_from_source);
    let off = error(&found, &pair.target_from_source, &pair.source);
    assert!(found.verdict() == Verdict::Ok && off < 0.3, "{off} {:?}", found.outcome);
    let wrong = refined(RigidTransform::rotation(Vector3::y() * 1.5) * pair.target_from_source);
    assert!(wrong.verdict() == Verdict::Failed && wrong.estimate().is_some());
    let far = refined(RigidTransform::translation(1e5, 0.0, 0.0));
    assert!(far.verdict() == Verdict::Failed && far.uncertainty().is_none());
}

/// A room scanned all round from one place by a level scanner, which is turned by `yaw`; in the scanner's frame.
fn level_scan(place: Vector3<f64>, yaw: f64, seed: u64) -> (RawScan, RigidTransform) {
    let mesh = shapes::room(3);
    let looks = (0..4).flat_map(|i| {
        let azimuth = f64::from(i) * std::f64::consts::FRAC_PI_2;
        let towards = place + Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let scanner = VirtualScanner {
            world_from_sensor: look_at(place, towards, Vector3::z()),
            width: 90,
            height: 90,
            horizontal_view: std::f64::consts::FRAC_PI_2,
            noise: RangeNoise::gaussian(0.003),
            max_incidence: 1.4,
        };
        let scan = scanner.scan(&mesh, 10 * seed + i as u64);
        moved(&scan.cloud(), &scan.world_from_sensor).points
    });
    let world = RawScan { points: looks.collect(), ..RawScan::default() };
    let world_from_scanner = RigidTransform::new(place, Vector3::z() * yaw);
    (moved(&world, &world_from_scanner.inverse()), world_from_scanner)
}

#[test]
fn levelled_scans_of_a_room_are_turned_about_up_alone() {
    let (source, world_from_source) = level_scan(Vector3::new(-0.4, 0.3, 1.3), 0.4, 1);
    let (target, world_from_target) = level_scan(Vector3::new(0.5, -0.2, 1.5), 2.9, 2);
    let truth = world_from_target.inverse() * world_from_source;
    let up = Vector3::z_axis();
    let found = run(&source, &target, &Prior { guess: None, up: Some(up) });
    let off = error(&found, &truth, &source);
    assert!(found.verdict() == Verdict::Ok && off < 1.0, "{off} {:?}", found.outcome);
    assert!((found.pose().unwrap().rotation * up).angle(&up) < 1e-9);
    // Scans that are not level are not forced to be: one tilted by 1.2 radians is out of bounds.
    let turned = RigidTransform::rotation(Vector3::x() * 1.2);
    let lying = run_once(&moved(&source, &turned), &target, &Prior { guess: None, up: Some(Unit::new_normalize(*up)) });
    assert!(lying.verdict() != Verdict::Ok, "{:?}", lying.outcome);
}
