//! Properties that all refiners share.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::random::Stream;
use congruent_geometry::{
    NearestField, NeighborIndex, Neighborhood, OrderedPoints, Orientation, Point, RigidTransform, Surface,
    angle_between, estimate_normals, mean_displacement, narrow, orient,
};
use congruent_refinement::{Freedom, GicpConfig, Nearest, PointToPlaneConfig, RefinementConfig, Refiner, Schedule};
use nalgebra::{Unit, Vector3};

/// A sheet over a square of side 60, with one point in each unit square, each with vertical noise.
fn sheet(height: impl Fn(f64, f64) -> f64, seed: u64, noise: f64) -> Surface {
    let mut stream = Stream::new(seed, 0);
    let points: Vec<Point> = (0..3600)
        .map(|i| {
            let (x, y) = (f64::from(i % 60) - 30.0 + stream.unit(), f64::from(i / 60) - 30.0 + stream.unit());
            let error: f64 = (0..12).map(|_| stream.unit()).sum::<f64>() - 6.0;
            narrow(&Vector3::new(x, y, height(x, y) + noise * error))
        })
        .collect();
    let index = NeighborIndex::new(&points);
    let mut normals: Vec<Point> =
        estimate_normals(&points, &index, Neighborhood::Nearest(20)).iter().map(|n| n.normal).collect();
    orient(Orientation::Viewpoint { at: [0.0, 0.0, 1e4] }, &points, &Vector3::zeros(), &index, 1.0, None, &mut normals);
    Surface::new(points, normals, index, 1.0)
}

fn bumpy(x: f64, y: f64) -> f64 {
    6.0 * (x / 9.0).sin() * (y / 7.0).cos() + 3.0 * ((x + 2.0 * y) / 11.0).sin()
}

/// All refiners, with a radius wide enough for the starts below.
fn members(freedom: Freedom) -> Vec<(&'static str, Box<dyn Refiner>)> {
    let start_radius = "6pr".parse().unwrap();
    let planes = PointToPlaneConfig { start_radius, rounds: 40, ..PointToPlaneConfig::default() };
    let discs = GicpConfig { start_radius, rounds: 40, ..GicpConfig::default() };
    vec![
        ("point-to-plane", RefinementConfig::PointToPlane(planes).build(1.0, freedom)),
        ("gicp", RefinementConfig::Gicp(discs).build(1.0, freedom)),
    ]
}

fn start() -> RigidTransform {
    RigidTransform::new(Vector3::new(1.0, -1.5, 0.8), Vector3::new(0.05, -0.04, 0.06))
}

#[test]
fn a_known_perturbation_is_undone_on_noisy_samples_of_one_surface() {
    let (source, target) = (sheet(bumpy, 1, 0.1), sheet(bumpy, 2, 0.1));
    for (name, member) in members(Freedom::All) {
        let refined = member.refine(&source, &target, &start());
        let error = mean_displacement(source.points(), &refined.target_from_source, &RigidTransform::identity());
        // Some 3000 distances with a noise of 0.14 pr, six unknowns.
        assert!(error < 0.05, "{name}: {error}");
        let known = refined.uncertainty.unwrap();
        assert!(known.free_directions.is_empty() && refined.n_pairs > 2000, "{name}");
        assert!(known.translation() < 0.05 && known.translation() > 1e-4, "{name}: {}", known.translation());
    }
}

#[test]
fn directions_that_a_plane_leaves_free_stay_as_they_were() {
    let flat = |_: f64, _: f64| 0.0;
    let (source, target) = (sheet(flat, 3, 0.05), sheet(flat, 4, 0.05));
    let start = RigidTransform::new(Vector3::new(0.7, -0.4, 0.5), Vector3::new(0.01, -0.01, 0.03));
    for (name, member) in members(Freedom::All) {
        let refined = member.refine(&source, &target, &start);
        let pose = refined.target_from_source;
        let slid = (pose.translation.vector - start.translation.vector).xy().norm();
        let yaw = pose.rotation.scaled_axis().z;
        assert!(slid < 0.02 && (yaw - 0.03).abs() < 1e-3, "{name}: {slid} {yaw}");
        assert!(pose.translation.vector.z.abs() < 0.03 && pose.rotation.scaled_axis().xy().norm() < 2e-3, "{name}");
        let known = refined.uncertainty.unwrap();
        assert_eq!(known.free_directions.len(), 3, "{name}");
        assert!(known.covariance.iter().all(|v| v.is_finite()), "{name}");
    }
}

#[test]
fn what_touches_nothing_stays_to_the_bit() {
    let surface = sheet(bumpy, 1, 0.1);
    let no_normals = Surface::new(
        surface.points().to_vec(),
        vec![[0.0; 3]; surface.len()],
        NeighborIndex::new(surface.points()),
        1.0,
    );
    let far = RigidTransform::translation(1e4, 0.0, 0.0);
    let any_normals = GicpConfig { min_normal_cosine: -1.0, ..GicpConfig::default() };
    let any_normals = ("any normals", RefinementConfig::Gicp(any_normals).build(1.0, Freedom::All));
    for (name, member) in members(Freedom::All).into_iter().chain([any_normals]) {
        for (source, target, start) in
            [(&surface, &surface, far), (&surface, &no_normals, start()), (&no_normals, &surface, start())]
        {
            let refined = member.refine(source, target, &start);
            assert_eq!(refined.target_from_source, start, "{name}");
            assert!(refined.n_pairs == 0 && refined.residual == 0.0 && refined.uncertainty.is_none(), "{name}");
        }
    }
}

#[test]
fn a_start_between_two_layers_that_it_never_reaches_is_kept() {
    // Points above and below by turns, which only the first round reaches; that moves the source into the middle.
    let level = |height: fn(i32) -> f32| {
        let points: Vec<Point> =
            (0..3600).map(|i| [(i % 60) as f32, (i / 60) as f32, height(i % 60 + i / 60)]).collect();
        let index = NeighborIndex::new(&points);
        Surface::new(points, vec![[0.0, 0.0, 1.0]; 3600], index, 1.0)
    };
    let (source, target) = (level(|_| 0.0), level(|i| if i % 2 == 0 { 5.8 } else { -5.8 }));
    let start = RigidTransform::translation(0.0, 0.0, 0.02);
    for (name, member) in members(Freedom::All) {
        let refined = member.refine(&source, &target, &start);
        assert_eq!((refined.target_from_source, refined.n_pairs), (start, 0), "{name}");
    }
}

#[test]
fn nothing_is_done_where_nothing_is_asked_for() {
    let surface = sheet(bumpy, 1, 0.1);
    let refined = RefinementConfig::None {}.build(1.0, Freedom::All).refine(&surface, &surface, &start());
    assert_eq!(refined.target_from_source, start());
}

#[test]
fn threads_do_not_matter() {
    let (source, target) = (sheet(bumpy, 1, 0.1), sheet(bumpy, 2, 0.1));
    for (name, member) in members(Freedom::All) {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let refined = pool.install(|| member.refine(&source, &target, &start()));
            (refined.target_from_source, refined.uncertainty.map(|known| known.covariance))
        };
        assert_eq!(run(1), run(4), "{name}");
    }
}

#[test]
fn motions_that_are_not_allowed_are_not_made() {
    let (source, target) = (sheet(bumpy, 1, 0.1), sheet(bumpy, 2, 0.1));
    let up = Unit::new_normalize(Vector3::new(0.02, 0.0, 1.0));
    let start = RigidTransform::new(Vector3::new(1.0, -1.5, 0.8), up.as_ref() * 0.06);
    for (name, member) in members(Freedom::About(up)) {
        let refined = member.refine(&source, &target, &start);
        let pose = refined.target_from_source;
        assert!((pose.rotation * up).angle(&up) < 1e-9, "{name}");
        assert!(angle_between(&pose, &RigidTransform::identity()) < 2e-3, "{name}");
        assert!(pose.translation.vector.norm() < 0.1, "{name}: {}", pose.translation.vector);
        assert!(refined.uncertainty.unwrap().free_directions.is_empty(), "{name}");
    }
}

#[test]
fn closest_points_may_come_from_a_grid() {
    let (source, target) = (sheet(bumpy, 1, 0.0), sheet(bumpy, 1, 0.0));
    let field = NearestField::new(target.points(), 0.5, 6.0);
    let planes = PointToPlaneConfig::default().build(1.0);
    let wide =
        congruent_refinement::PointToPlane { schedule: Schedule { start_radius: 6.0, rounds: 40, ..planes.schedule } };
    let ordered = OrderedPoints::new(target.points(), 1.5);
    for nearest in [target.index() as &dyn Nearest, &ordered, &field] {
        let pose = wide.descend(&source, &target, nearest, &start());
        let error = mean_displacement(source.points(), &pose, &RigidTransform::identity());
        assert!(error < 0.05, "{error}");
    }
}
