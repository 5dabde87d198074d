//! A pool of poses that are really different.

use crate::Hypothesis;
use congruent_geometry::{Point, RigidTransform, wide};
use nalgebra::{Point3, Vector3};

/// Points by which poses are compared.
const PROBES: usize = 8;

/// Tells poses apart by how far they put a few points of the source from each other.
#[derive(Clone, Debug)]
pub struct Distinctness {
    probes: Vec<Point3<f64>>,
    /// Poses with a smaller mean displacement of the probes are the same.
    min_displacement: f64,
}

impl Distinctness {
    /// Probes are spread evenly over the order of `points`.
    #[must_use]
    pub fn new(points: &[Point], min_displacement: f64) -> Self {
        let stride = points.len().div_ceil(PROBES).max(1);
        let probes = points.iter().step_by(stride).map(|p| Point3::from(wide(*p))).collect();
        Distinctness { probes, min_displacement }
    }

    /// The best of each group of like poses, at most `keep`. The hypotheses come ranked, and stay so.
    #[must_use]
    pub fn distinct(&self, ranked: &[Hypothesis], keep: usize) -> Vec<Hypothesis> {
        let mut kept: Vec<(Vec<Vector3<f64>>, Hypothesis)> = Vec::new();
        for hypothesis in ranked {
            if kept.len() == keep {
                break;
            }
            let places = self.places(&hypothesis.target_from_source);
            if kept.iter().all(|(other, _)| !self.same(other, &places)) {
                kept.push((places, *hypothesis));
            }
        }
        kept.into_iter().map(|(_, hypothesis)| hypothesis).collect()
    }

    fn places(&self, pose: &RigidTransform) -> Vec<Vector3<f64>> {
        self.probes.iter().map(|p| (pose * p).coords).collect()
    }

    fn same(&self, a: &[Vector3<f64>], b: &[Vector3<f64>]) -> bool {
        let limit = self.min_displacement * a.len() as f64;
        // A sum of lengths is at least its first term: most pairs are settled by one probe.
        let mut sum = 0.0;
        for (a, b) in a.iter().zip(b) {
            sum += (a - b).norm();
            if sum >= limit {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_metrics::Score;

    #[test]
    fn the_best_of_like_poses_stays() {
        let points: Vec<Point> = (0..100).map(|i| [i as f32, 0.0, 0.0]).collect();
        let at = |x: f64, trial: u64| Hypothesis {
            target_from_source: RigidTransform::translation(x, 0.0, 0.0),
            score: Score::new(-(trial as f64)),
            trial,
        };
        let ranked = [at(0.0, 0), at(3.0, 1), at(7.0, 2), at(6.5, 3), at(-9.0, 4)];
        let trials =
            |keep| Distinctness::new(&points, 5.0).distinct(&ranked, keep).iter().map(|h| h.trial).collect::<Vec<_>>();
        assert_eq!(trials(9), [0, 2, 4]);
        assert_eq!(trials(2), [0, 2]);
    }
}
