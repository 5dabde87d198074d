//! Correspondences with the local reference frames of their points.

use congruent_metrics::Evidence;
use nalgebra::{Matrix3, Vector3};

/// A point and its local reference frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FramedPoint {
    pub(crate) point: Vector3<f64>,
    /// Rows x, y, z.
    pub(crate) axes: Matrix3<f64>,
}

impl FramedPoint {
    /// Returns the z axis, the one that is determined best, which some call the local reference axis.
    pub(crate) fn z(&self) -> Vector3<f64> {
        self.axes.row(2).transpose()
    }
}

/// Both ends of a correspondence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FramedPair {
    pub(crate) source: FramedPoint,
    pub(crate) target: FramedPoint,
}

/// Returns the correspondences with frames at both ends, in ranking order.
pub(crate) fn framed(evidence: &Evidence) -> Vec<FramedPair> {
    let pair = |i: usize| {
        let (source, target) = evidence.frames(i)?;
        Some(FramedPair {
            source: FramedPoint { point: evidence.source(i), axes: source },
            target: FramedPoint { point: evidence.target(i), axes: target },
        })
    };
    (0..evidence.len()).filter_map(pair).collect()
}

/// Scenes for the tests of estimators that read frames.
#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_geometry::{RigidTransform, narrow};
    use nalgebra::Point3;

    /// Exact correspondences with exact frames in a box of side `side`, and the true pose.
    pub(crate) fn scene(n: usize, side: f64, seed: u64) -> (Evidence, RigidTransform) {
        let mut stream = Stream::new(seed, 0);
        let truth = RigidTransform::from_parts(nalgebra::Translation3::identity(), stream.rotation());
        let rotation = *truth.rotation.to_rotation_matrix().matrix();
        let (mut pairs, mut frames) = (vec![], vec![]);
        for _ in 0..n {
            let p = Vector3::from_fn(|_, _| stream.between(-0.5, 0.5)) * side;
            let axes = *stream.rotation().to_rotation_matrix().matrix();
            pairs.push((narrow(&p), narrow(&(truth * Point3::from(p)).coords)));
            // Axes are the rows: those of the target are the rotated ones of the source.
            frames.push(Some((axes, axes * rotation.transpose())));
        }
        (Evidence::new(pairs).with_frames(frames), truth)
    }

    #[test]
    fn pairs_without_frames_are_left_out() {
        let (evidence, _) = scene(3, 1.0, 1);
        let frames = vec![evidence.frames(0), None, evidence.frames(2)];
        let evidence = evidence.with_frames(frames);
        let pairs = framed(&evidence);
        assert_eq!(pairs.len(), 2);
        assert_eq!(pairs[1].source.point, evidence.source(2));
        assert!(framed(&Evidence::new([([0.0; 3], [0.0; 3])])).is_empty());
    }
}
