//! A ring of scans with known poses, and its complete reconstruction.

use crate::edge::motion_of;
use crate::{Belief, Candidate, Contact, Edge, Fate, NoContact, Node, Reconstruction, Settings, Touch, reconstruct};
use congruent_geometry::RigidTransform;
use congruent_geometry::random::Stream;
use nalgebra::{Matrix6, Point3, Vector3, Vector6};

/// Half the width of every scan; the resolution is one.
const RADIUS: f64 = 60.0;

/// A motion that rotates by `angle` (radians) and translates by `distance`, each in a random direction.
pub(crate) fn moved_apart(seed: u64, distance: f64, angle: f64) -> RigidTransform {
    let mut stream = Stream::new(seed, 99);
    let mut direction = || Vector3::from_fn(|_, _| stream.normal()).normalize();
    RigidTransform::new(direction() * distance, direction() * angle)
}

/// Scans whose probes are spread over a cube.
pub(crate) fn nodes(n: usize) -> Vec<Node> {
    let node = |i: usize| {
        let mut stream = Stream::new(17, i as u64);
        let probe = |_| Vector3::from_fn(|_, _| stream.between(-RADIUS, RADIUS));
        Node { probes: (0..32).map(probe).collect() }
    };
    (0..n).map(node).collect()
}

/// The touch of 400 points in a cube: `Σ GᵀG` with `G = [−[q]ₓ  I]`.
fn touch() -> Touch {
    let mut information = Matrix6::zeros();
    let mut stream = Stream::new(23, 0);
    for _ in 0..400 {
        let cross = -Vector3::from_fn(|_, _| stream.between(-RADIUS, RADIUS)).cross_matrix();
        let mut g = nalgebra::Matrix3x6::zeros();
        g.fixed_view_mut::<3, 3>(0, 0).copy_from(&cross);
        g.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        information += g.transpose() * g;
    }
    Touch { information, support: 400.0, residual: 0.5 }
}

pub(crate) fn candidate(source: usize, target: usize, pose: RigidTransform, belief: Belief) -> Candidate {
    Candidate { source, target, target_from_source: pose, touch: touch(), confidence: 0.9, belief }
}

pub(crate) struct Ring {
    pub(crate) truth: Vec<RigidTransform>,
    pub(crate) edges: Vec<Edge>,
    candidates: Vec<Candidate>,
}

/// `n` scans around an object, each registered with the next three, every pose perturbed by about `noise` resolutions.
pub(crate) fn ring(n: usize, noise: f64) -> Ring {
    let look = |i: usize| {
        let turn = std::f64::consts::TAU * i as f64 / n as f64;
        RigidTransform::rotation(Vector3::y() * turn) * RigidTransform::translation(0.0, 5.0 * turn.sin(), 150.0)
    };
    let truth: Vec<RigidTransform> = (0..n).map(look).map(|pose| look(0).inverse() * pose).collect();
    let mut stream = Stream::new(31, n as u64);
    let mut off = || {
        let (turn, shift) = (noise / RADIUS * 0.5, noise * 0.5);
        motion_of(&Vector6::from_fn(|i, _| stream.normal() * if i < 3 { turn } else { shift }))
    };
    let pairs = (1..=3).flat_map(|step| (0..n).map(move |i| (i, (i + step) % n)));
    let candidates: Vec<Candidate> = pairs
        .map(|(source, target)| {
            let pose = off() * truth[target].inverse() * truth[source];
            candidate(source, target, pose, Belief::Believed)
        })
        .collect();
    let edge = |c: &Candidate| Edge {
        source: c.source,
        target: c.target,
        target_from_source: c.target_from_source,
        information: c.touch.precision(0.1),
    };
    Ring { edges: candidates.iter().map(edge).collect(), truth, candidates }
}

impl Ring {
    /// Adds wrong candidates until they are this fraction of all: half of them between scans four apart, the nearest
    /// without a right candidate, half between scans farther apart, all as confident as the right ones.
    fn with_wrong(mut self, share: f64) -> (Ring, Vec<bool>) {
        let (n, right) = (self.truth.len(), self.candidates.len());
        let wrong = (right as f64 * share / (1.0 - share)).ceil() as usize;
        let mut stream = Stream::new(47, 0);
        for i in 0..wrong {
            let source = stream.below(n as u32) as usize;
            let target = (source + if i % 2 == 0 { 4 } else { 5 + stream.below(n as u32 - 9) as usize }) % n;
            let shift = Vector3::from_fn(|_, _| stream.between(-150.0, 150.0));
            let pose = RigidTransform::from_parts(shift.into(), stream.rotation());
            self.candidates.push(candidate(source, target, pose, Belief::Believed));
        }
        let is_wrong = (0..self.candidates.len()).map(|at| at >= right).collect();
        (self, is_wrong)
    }

    fn reconstructed(&self) -> Reconstruction {
        reconstruct(&nodes(self.truth.len()), &self.candidates, &NoContact, &Settings::new(1.0))
    }
}

/// Returns the mean error of the relative poses of all pairs of scans.
fn mean_error(found: &[RigidTransform], truth: &[RigidTransform]) -> f64 {
    let nodes = nodes(truth.len());
    // The first scan's own error is not that of the others: compare every scan with every other one.
    let mut errors = Vec::new();
    for i in 0..truth.len() {
        for j in (0..truth.len()).filter(|j| *j != i) {
            let (a, b) = (found[j].inverse() * found[i], truth[j].inverse() * truth[i]);
            let off = |p: &Vector3<f64>| (a * Point3::from(*p) - b * Point3::from(*p)).norm();
            errors.push(nodes[i].probes.iter().map(off).sum::<f64>() / nodes[i].probes.len() as f64);
        }
    }
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_ring_of_24_rejects_all_of_30_per_cent_wrong_poses() {
    let (ring, is_wrong) = ring(24, 0.7).with_wrong(0.3);
    let share = is_wrong.iter().filter(|wrong| **wrong).count() as f64 / is_wrong.len() as f64;
    assert!(share >= 0.3, "{share}");
    let result = ring.reconstructed();
    assert_eq!(result.components, [(0..24).collect::<Vec<_>>()]);
    for (fate, wrong) in result.fates.iter().zip(&is_wrong) {
        assert!(*wrong != matches!(fate, Fate::Kept | Fate::Agrees), "{fate:?}");
    }
    let error = mean_error(&result.frame_from_scan, &ring.truth);
    assert!(error < 1.0, "{error}");
}

#[test]
fn wrong_poses_cost_next_to_nothing() {
    let clean = ring(24, 0.7);
    let (spoiled, _) = ring(24, 0.7).with_wrong(0.3);
    let error = |ring: &Ring| mean_error(&ring.reconstructed().frame_from_scan, &ring.truth);
    assert!((error(&spoiled) - error(&clean)).abs() < 0.02, "{} {}", error(&spoiled), error(&clean));
}

#[test]
fn the_order_of_scans_and_candidates_does_not_matter() {
    let (ring, _) = ring(24, 0.7).with_wrong(0.3);
    let n = ring.truth.len();
    let renamed = |i: usize| (7 * i + 5) % n;
    let mut nodes_there = vec![Node::default(); n];
    nodes(n).into_iter().enumerate().for_each(|(i, node)| nodes_there[renamed(i)] = node);
    let turned = |c: &Candidate| Candidate { source: renamed(c.source), target: renamed(c.target), ..c.clone() };
    let candidates: Vec<Candidate> = ring.candidates.iter().rev().map(turned).collect();
    let here = ring.reconstructed();
    let there = reconstruct(&nodes_there, &candidates, &NoContact, &Settings::new(1.0));
    for i in 0..n {
        let place = |poses: &[RigidTransform], i: usize, base: usize| poses[base].inverse() * poses[i];
        let (a, b) = (place(&here.frame_from_scan, i, 0), place(&there.frame_from_scan, renamed(i), renamed(0)));
        assert!((a.to_homogeneous() - b.to_homogeneous()).norm() < 1e-3, "{i}");
    }
    assert!(
        here.fates
            .iter()
            .zip(there.fates.iter().rev())
            .all(|(a, b)| { std::mem::discriminant(a) == std::mem::discriminant(b) })
    );
}

#[test]
fn threads_do_not_matter() {
    let (ring, _) = ring(24, 0.7).with_wrong(0.3);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let contact = Pulled { truth: ring.truth.clone() };
        pool.install(|| reconstruct(&nodes(24), &ring.candidates, &contact, &Settings::new(1.0)))
    };
    let (one, four) = (run(1), run(4));
    assert_eq!(one.frame_from_scan, four.frame_from_scan);
    assert_eq!((one.fates, one.uncertainty), (four.fates, four.uncertainty));
}

#[test]
fn what_nothing_holds_together_stays_apart() {
    let mut candidates = ring(6, 0.3).candidates;
    // Two rings of six, and a scan without candidates; one wrong doubtful pose between the rings.
    let second: Vec<Candidate> =
        candidates.iter().map(|c| Candidate { source: c.source + 7, target: c.target + 7, ..c.clone() }).collect();
    candidates.extend(second);
    candidates.push(candidate(0, 8, moved_apart(1, 30.0, 1.0), Belief::Doubted));
    let result = reconstruct(&nodes(13), &candidates, &NoContact, &Settings::new(1.0));
    assert_eq!(result.components, [vec![0, 1, 2, 3, 4, 5], vec![7, 8, 9, 10, 11, 12], vec![6]]);
    assert_eq!(*result.fates.last().unwrap(), Fate::Unsupported);
    assert!(result.uncertainty[6].is_none() && result.uncertainty[7] == Some(0.0));
}

#[test]
fn no_scans_and_no_candidates_are_fine() {
    let none = reconstruct(&[], &[], &NoContact, &Settings::new(1.0));
    assert!(none.components.is_empty() && none.frame_from_scan.is_empty());
    let alone = reconstruct(&nodes(2), &[], &NoContact, &Settings::new(1.0));
    assert_eq!(alone.components, [vec![0], vec![1]]);
    assert!(!alone.refined && alone.edges.is_empty());
}

#[test]
fn uncertainty_grows_with_the_way_from_the_first_scan() {
    let result = ring(24, 0.7).reconstructed();
    let of = |i: usize| result.uncertainty[i].unwrap();
    assert!(of(0) == 0.0 && of(1) > 0.0 && of(6) > of(1) && of(12) > of(6), "{:?}", result.uncertainty);
}

/// Surfaces that know the true poses and lead half of the way there.
struct Pulled {
    truth: Vec<RigidTransform>,
}

impl Pulled {
    fn off(&self, source: usize, target: usize, pose: &RigidTransform) -> RigidTransform {
        self.truth[target].inverse() * self.truth[source] * pose.inverse()
    }
}

impl Contact for Pulled {
    fn measure(&self, source: usize, target: usize, pose: &RigidTransform) -> Option<Touch> {
        let n = self.truth.len();
        let apart = (source + n - target) % n;
        if apart > 4 && apart < n - 4 {
            return None;
        }
        let off = crate::edge::vector_of(&self.off(source, target, pose)).norm();
        Some(Touch { support: 400.0 / (1.0 + off), ..touch() })
    }

    fn align(&self, source: usize, target: usize, pose: &RigidTransform, _: usize) -> Option<(RigidTransform, Touch)> {
        let touch = self.measure(source, target, pose)?;
        let half = motion_of(&(crate::edge::vector_of(&self.off(source, target, pose)) * 0.5));
        Some((half * pose, touch))
    }
}

#[test]
fn the_joint_refinement_goes_where_the_surfaces_lead() {
    let ring = ring(24, 1.0);
    let contact = Pulled { truth: ring.truth.clone() };
    let settings = Settings { rounds: 40, ..Settings::new(1.0) };
    let result = reconstruct(&nodes(24), &ring.candidates, &contact, &settings);
    assert!(result.refined);
    let error = mean_error(&result.frame_from_scan, &ring.truth);
    assert!(error < 0.1 && error < 0.2 * mean_error(&ring.reconstructed().frame_from_scan, &ring.truth), "{error}");
}

/// Surfaces that lead away: the start is better.
struct Misled(Pulled);

impl Contact for Misled {
    fn measure(&self, source: usize, target: usize, pose: &RigidTransform) -> Option<Touch> {
        self.0.measure(source, target, pose)
    }

    fn align(&self, source: usize, target: usize, pose: &RigidTransform, _: usize) -> Option<(RigidTransform, Touch)> {
        let touch = self.measure(source, target, pose)?;
        Some((moved_apart((source * 24 + target) as u64, 5.0, 0.05) * pose, touch))
    }
}

#[test]
fn a_refinement_that_loses_touch_is_not_taken() {
    let ring = ring(24, 0.3);
    let contact = Misled(Pulled { truth: ring.truth.clone() });
    let result = reconstruct(&nodes(24), &ring.candidates, &contact, &Settings::new(1.0));
    assert!(!result.refined);
    let graph_alone = ring.reconstructed();
    assert_eq!(result.frame_from_scan, graph_alone.frame_from_scan);
    assert_eq!(result.uncertainty, graph_alone.uncertainty);
    // What is reported are the contacts of the kept candidates, in both directions.
    assert_eq!(result.edges.len(), 2 * graph_alone.edges.len());
    for pair in result.edges.chunks(2) {
        let (forth, back) = (&pair[0].0, &pair[1].0);
        assert_eq!((forth.source, forth.target), (back.target, back.source));
        assert_eq!(forth.target_from_source.inverse(), back.target_from_source);
    }
}

/// The touch of two horizontal planes: only motions out of the plane separate them.
fn flat_touch() -> Touch {
    let mut information = Matrix6::zeros();
    let mut stream = Stream::new(29, 0);
    for _ in 0..400 {
        let at = Vector3::new(stream.between(-RADIUS, RADIUS), stream.between(-RADIUS, RADIUS), 0.0);
        let turning = at.cross(&Vector3::z());
        let row = Vector6::new(turning.x, turning.y, turning.z, 0.0, 0.0, 1.0);
        information += row * row.transpose();
    }
    Touch { information, support: 400.0, residual: 0.5 }
}

#[test]
fn planes_that_slide_are_displaced_and_not_pulled_apart() {
    let fate_of = |shift: [f64; 3]| {
        let same = RigidTransform::identity();
        let other = candidate(2, 0, RigidTransform::translation(shift[0], shift[1], shift[2]), Belief::Uncertain);
        let candidates = [
            candidate(1, 0, same, Belief::Believed),
            candidate(2, 1, same, Belief::Believed),
            Candidate { touch: flat_touch(), ..other },
        ];
        reconstruct(&nodes(3), &candidates, &NoContact, &Settings::new(1.0)).fates[2]
    };
    let slid = fate_of([20.0, 0.0, 0.0]);
    assert!(matches!(slid, Fate::Displaced { displacement } if (displacement - 20.0).abs() < 0.1), "{slid:?}");
    let apart = fate_of([0.0, 0.0, 20.0]);
    assert!(matches!(apart, Fate::Contradicted { parting } if (parting - 20.0).abs() < 0.1), "{apart:?}");
}
