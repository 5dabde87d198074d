//! 2SAC-GC: two correspondences with reference axes determine a pose, if they preserve what a rigid motion preserves.

use crate::HypothesisGenerator;
use crate::draws::two_of;
use crate::framed::{FramedPair, FramedPoint, framed};
use congruent_geometry::RigidTransform;
use congruent_geometry::random::Stream;
use congruent_metrics::Evidence;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Maximum number of draws per trial: rejected samples are drawn again and do not count as trials. With few inliers one
/// sample in fifty passes the constraints.
const MAX_REDRAWS: u64 = 1000;
/// Minimum sine of the angle between the axes and the line between the points; below it, the rotation about the line is
/// undetermined.
const MIN_SINE: f64 = 0.1;

/// The global constraints: what a rigid motion preserves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairRule {
    /// Maximum difference of the distances between the two points, data units.
    pub length_tolerance: f64,
    /// Maximum difference of the angles between the two axes, radians; π accepts everything.
    pub max_angle: f64,
}

impl PairRule {
    fn accepts(&self, a: &FramedPair, b: &FramedPair) -> bool {
        let length = |a: &FramedPoint, b: &FramedPoint| (a.point - b.point).norm();
        let angle = |a: &FramedPoint, b: &FramedPoint| a.z().angle(&b.z());
        (length(&a.source, &b.source) - length(&a.target, &b.target)).abs() <= self.length_tolerance
            && (angle(&a.source, &b.source) - angle(&a.target, &b.target)).abs() <= self.max_angle
    }
}

/// Poses from two different correspondences each that preserve their distance and the angle of their axes. Pairs
/// without frames are left out.
pub struct TwoPoint {
    pairs: Vec<FramedPair>,
    rule: PairRule,
    trials: u64,
    seed: u64,
}

impl TwoPoint {
    /// Draws from `evidence`; fewer than two pairs with frames propose nothing.
    #[must_use]
    pub fn new(evidence: &Evidence, rule: PairRule, trials: u64, seed: u64) -> Self {
        TwoPoint { pairs: framed(evidence), rule, trials, seed }
    }
}

impl HypothesisGenerator for TwoPoint {
    fn trials(&self) -> u64 {
        self.trials
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let n = u32::try_from(self.pairs.len()).ok().filter(|&n| n >= 2)?;
        let mut stream = Stream::new(self.seed, trial);
        (0..MAX_REDRAWS).find_map(|_| {
            let [a, b] = two_of(n, &mut stream).map(|i| &self.pairs[i as usize]);
            if self.rule.accepts(a, b) { fit(a, b) } else { None }
        })
    }
}

/// Returns the pose that aligns line with line, midpoint with midpoint and, about the line, axes with axes. It does not
/// depend on the unit of length. `None` if the points coincide or the axes run along the line.
fn fit(a: &FramedPair, b: &FramedPair) -> Option<RigidTransform> {
    let (in_source, in_target) = (Line::of(&a.source, &b.source)?, Line::of(&a.target, &b.target)?);
    // The same axis in both clouds: the first one, or the sum if that is farther off the line.
    let lesser = |pick: fn(&Line) -> Vector3<f64>| pick(&in_source).norm().min(pick(&in_target).norm());
    let pick: fn(&Line) -> Vector3<f64> =
        if lesser(|line| line.sum) > lesser(|line| line.first) { |line| line.sum } else { |line| line.first };
    if lesser(pick) < MIN_SINE {
        return None;
    }
    let turn = in_target.axes(&pick(&in_target)) * in_source.axes(&pick(&in_source)).transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    let middle = |a: &FramedPoint, b: &FramedPoint| (a.point + b.point) / 2.0;
    let shift = middle(&a.target, &b.target) - rotation * middle(&a.source, &b.source);
    Some(RigidTransform::from_parts(Translation3::from(shift), rotation))
}

/// The line between two points, and the components of their axes perpendicular to it.
struct Line {
    direction: Vector3<f64>,
    /// Component of the first point's axis.
    first: Vector3<f64>,
    /// Component of the sum of both axes.
    sum: Vector3<f64>,
}

impl Line {
    fn of(a: &FramedPoint, b: &FramedPoint) -> Option<Line> {
        let direction = (b.point - a.point).try_normalize(0.0)?;
        let across = |v: Vector3<f64>| v - direction * v.dot(&direction);
        Some(Line { direction, first: across(a.z()), sum: across(a.z() + b.z()) })
    }

    /// Returns right-handed axes, as columns: along the line, across it, and perpendicular to both.
    fn axes(&self, across: &Vector3<f64>) -> Matrix3<f64> {
        let across = across.normalize();
        Matrix3::from_columns(&[self.direction, across, self.direction.cross(&across)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framed::tests::scene;
    use congruent_geometry::{angle_between, narrow};

    fn rule(length_tolerance: f64) -> PairRule {
        PairRule { length_tolerance, max_angle: 15f64.to_radians() }
    }

    #[test]
    fn any_two_exact_pairs_give_the_pose() {
        let (evidence, truth) = scene(30, 100.0, 1);
        let generator = TwoPoint::new(&evidence, rule(7.5), 100, 2);
        for trial in 0..100 {
            let pose = generator.propose(trial).unwrap();
            // Points are stored in `f32`; the shortest lines here are a few units long.
            assert!(angle_between(&pose, &truth) < 1e-4, "trial {trial}");
            assert!(pose.translation.vector.norm() < 1e-2);
        }
    }

    #[test]
    fn the_unit_of_length_does_not_matter() {
        let (metres, _) = scene(30, 0.2, 3);
        // Powers of two keep the stored points exact.
        let scaled = |by: f64| {
            let grown = |p: Vector3<f64>| narrow(&(p * by));
            let pairs: Vec<_> = (0..30).map(|i| (grown(metres.source(i)), grown(metres.target(i)))).collect();
            Evidence::new(pairs).with_frames((0..30).map(|i| metres.frames(i)).collect())
        };
        let small = TwoPoint::new(&metres, rule(0.01), 50, 4);
        for by in [1024.0, 1.0 / 1024.0] {
            let evidence = scaled(by);
            let large = TwoPoint::new(&evidence, rule(0.01 * by), 50, 4);
            for trial in 0..50 {
                let (a, b) = (small.propose(trial).unwrap(), large.propose(trial).unwrap());
                assert!(angle_between(&a, &b) < 1e-12);
                assert!((a.translation.vector * by - b.translation.vector).norm() < 1e-12 * by);
            }
        }
    }

    /// A point on the x axis whose z axis is tilted by `lean` from the y towards the z direction.
    fn at(x: f64, lean: f64) -> FramedPoint {
        let z = Vector3::new(0.0, lean.cos(), lean.sin());
        let x_axis = Vector3::x();
        let axes = Matrix3::from_rows(&[x_axis.transpose(), z.cross(&x_axis).transpose(), z.transpose()]);
        FramedPoint { point: Vector3::new(x, 0.0, 0.0), axes }
    }

    #[test]
    fn both_constraints_must_hold() {
        let rule = rule(7.5);
        let first = FramedPair { source: at(0.0, 0.0), target: at(0.0, 0.0) };
        for (x, lean_deg, expected) in [
            (50.0, 0.0, true),
            (57.5, 0.0, true),
            (57.6, 0.0, false),
            (42.4, 0.0, false),
            (50.0, 14.9, true),
            // A comparison of radians with 15 would let this pass.
            (50.0, 15.1, false),
            (50.0, -60.0, false),
        ] {
            let second = FramedPair { source: at(50.0, 0.0), target: at(x, f64::to_radians(lean_deg)) };
            assert_eq!(rule.accepts(&first, &second), expected, "{x} {lean_deg}");
        }
        let blind = PairRule { max_angle: std::f64::consts::PI, ..rule };
        assert!(blind.accepts(&first, &FramedPair { source: at(50.0, 0.0), target: at(50.0, 3.0) }));
    }

    #[test]
    fn a_turn_that_is_open_is_no_pose() {
        let along = |x: f64| {
            // z along the line.
            let axes = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
            FramedPoint { point: Vector3::new(x, 0.0, 0.0), axes }
        };
        let same = |point: FramedPoint| FramedPair { source: point, target: point };
        assert!(fit(&same(along(0.0)), &same(along(9.0))).is_none());
        assert!(fit(&same(at(4.0, 0.0)), &same(at(4.0, 0.0))).is_none());
        // One axis across the line is enough, and so is the other one.
        assert!(fit(&same(along(0.0)), &same(at(9.0, 0.0))).is_some());
        assert!(fit(&same(at(0.0, 0.0)), &same(along(9.0))).is_some());
        // Opposite axes cancel in the sum, but not in the first.
        assert!(fit(&same(at(0.0, 0.0)), &same(at(9.0, std::f64::consts::PI))).is_some());
    }

    #[test]
    fn without_two_frames_there_is_no_pose() {
        let (evidence, _) = scene(3, 100.0, 5);
        for usable in 0..=2 {
            let frames = (0..3).map(|i| evidence.frames(i).filter(|_| i < usable)).collect();
            let generator = TwoPoint::new(&evidence.clone().with_frames(frames), rule(7.5), 10, 0);
            assert_eq!(generator.propose(0).is_some(), usable == 2);
        }
    }
}
