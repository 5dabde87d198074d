//! 1P-RANSAC: one correspondence with its local reference frames determines a pose.

use crate::HypothesisGenerator;
use crate::framed::{FramedPair, framed};
use congruent_geometry::RigidTransform;
use congruent_geometry::random::Stream;
use congruent_metrics::Evidence;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};

/// Poses that align the frame of a source point with that of its target point. Pairs without frames are left out.
///
/// There are only as many poses as pairs: with that many trials, each is proposed once, in ranking order.
pub struct OnePoint {
    pairs: Vec<FramedPair>,
    trials: u64,
    seed: u64,
}

impl OnePoint {
    /// Creates a generator of at most `trials` poses: all of them if there are no more, otherwise random ones.
    #[must_use]
    pub fn new(evidence: &Evidence, trials: u64, seed: u64) -> Self {
        let pairs = framed(evidence);
        OnePoint { trials: trials.min(pairs.len() as u64), pairs, seed }
    }

    fn pair(&self, trial: u64) -> Option<&FramedPair> {
        let all = self.pairs.len() as u64;
        let i = if self.trials == all { trial } else { Stream::new(self.seed, trial).below(all as u32).into() };
        self.pairs.get(i as usize)
    }
}

impl HypothesisGenerator for OnePoint {
    fn trials(&self) -> u64 {
        self.trials
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        let FramedPair { source, target } = self.pair(trial)?;
        let rotation = Rotation3::from_matrix_unchecked(target.axes.transpose() * source.axes);
        // The frames are rotations up to rounding; this makes the result exact.
        let rotation = UnitQuaternion::new_normalize(*UnitQuaternion::from_rotation_matrix(&rotation));
        Some(RigidTransform::from_parts(Translation3::from(target.point - rotation * source.point), rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framed::tests::scene;
    use congruent_geometry::angle_between;

    #[test]
    fn each_pair_proposes_the_pose_once_in_ranking_order() {
        let (evidence, truth) = scene(40, 100.0, 1);
        for trials in [40, 41, 1000] {
            let generator = OnePoint::new(&evidence, trials, 5);
            assert_eq!(generator.trials(), 40);
            for trial in 0..40 {
                let pose = generator.propose(trial).unwrap();
                assert!(angle_between(&pose, &truth) < 1e-9);
                assert!(evidence.residual(trial as usize, &pose) < 1e-9, "the pose goes through its own pair");
            }
            assert!(generator.propose(40).is_none());
        }
    }

    #[test]
    fn fewer_trials_than_pairs_draw_at_random() {
        let (evidence, _) = scene(200, 100.0, 2);
        let poses = |seed| {
            let generator = OnePoint::new(&evidence, 50, seed);
            assert_eq!(generator.trials(), 50);
            (0..50).map(|trial| generator.propose(trial).unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(poses(1), poses(1));
        assert_ne!(poses(1), poses(2));
        let late = poses(1).iter().filter(|pose| (100..200).any(|i| evidence.residual(i, pose) < 1e-9)).count();
        assert!((10..=40).contains(&late), "{late} of 50 come from the second half");
    }

    #[test]
    fn without_frames_there_is_no_pose() {
        let (evidence, _) = scene(4, 100.0, 3);
        for frames in [vec![None; 4], vec![None, None, evidence.frames(2), None]] {
            let usable = frames.iter().flatten().count() as u64;
            let generator = OnePoint::new(&evidence.clone().with_frames(frames), 10, 0);
            assert_eq!(generator.trials(), usable);
            assert_eq!(generator.propose(0).is_some(), usable > 0);
        }
    }
}
