//! Matched point pairs with a known motion, generated without any scan.
//!
//! Lengths are in units of the resolution: pr = 1. Wrong pairs spread evenly over the surface are easy for any metric;
//! what real matching gets wrong is near the truth, and on smooth or partly symmetric surfaces it even agrees with one
//! second motion. [`NearMiss`] generates both kinds.

use congruent_geometry::random::Stream;
use congruent_geometry::{Point, RigidTransform, narrow};
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Extent of the surface along x, y and z.
const SURFACE: [f64; 3] = [250.0, 220.0, 100.0];
/// Standard deviation of an inlier's error on one axis, to be multiplied by a factor from `INLIER_SPREAD`.
const INLIER_SIGMA: f64 = 1.5;
/// Keypoints are not located equally well: each axis of each inlier draws its own factor from this interval.
const INLIER_SPREAD: [f64; 2] = [0.3, 1.6];
/// Error of random near misses.
const MISS_DISTANCE: [f64; 2] = [5.0, 20.0];
/// Angle by which the second motion is rotated relative to the true one, degrees.
const SECOND_TURN_DEG: [f64; 2] = [3.0, 6.0];
/// Standard deviation, on each axis, of pairs that follow the second motion.
const SECOND_SIGMA: f64 = 4.0;
/// Maximum translation of the true motion on each axis.
const SHIFT: f64 = 200.0;
/// Number of points for evaluating a motion.
const N_SURFACE: usize = 1000;

/// How near misses are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NearMiss {
    /// Independently: 5 to 20 off in a random direction.
    Random,
    /// Together: they follow one second motion, the true one after a rotation of 3 to 6° about the middle of the source
    /// surface, with an error of standard deviation 4 on each axis.
    Coherent,
}

/// A recipe for pairs: how many are right, how many nearly right, and the rest anywhere on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrespondenceScene {
    /// Number of pairs.
    pub n: usize,
    /// Right pairs as a fraction of `n`; rounded to whole pairs.
    pub inlier_share: f64,
    /// Nearly right pairs as a fraction of `n`; at most what the inliers leave.
    pub near_miss_share: f64,
    /// The kind of near misses.
    pub near_miss: NearMiss,
}

/// The kind of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairKind {
    /// Follows the true motion up to a small error.
    Inlier,
    /// Narrowly misses the true motion.
    NearMiss,
    /// Joins two independent positions on the surface.
    Outlier,
}

/// Pairs and their true motion. The pairs are in random order.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondences {
    /// Source points.
    pub source: Vec<Point>,
    /// The target point of each source point.
    pub target: Vec<Point>,
    /// The kind of each pair.
    pub kinds: Vec<PairKind>,
    /// The true motion, `target_from_source`.
    pub truth: RigidTransform,
    /// The motion that coherent near misses follow, whether or not there are any.
    pub second: RigidTransform,
    /// A thousand points all over the source surface, to measure the error of a motion.
    pub surface: Vec<Point>,
}

impl CorrespondenceScene {
    /// Generates the pairs. Fractions outside 0 to 1 are clamped.
    #[must_use]
    pub fn generate(&self, seed: u64) -> Correspondences {
        let mut stream = Stream::new(seed, 0);
        let turn = stream.rotation();
        let shift = Vector3::from_fn(|_, _| stream.between(-SHIFT, SHIFT));
        let truth = RigidTransform::from_parts(Translation3::from(shift), turn);
        let second = truth * second_turn(&mut stream);

        let kinds = self.kinds(&mut Stream::new(seed, 1));
        let pair = |(i, kind): (u64, &PairKind)| {
            let mut stream = Stream::new(seed, 2 + i);
            let source = on_surface(&mut stream);
            let target = match (kind, self.near_miss) {
                (PairKind::Inlier, _) => truth * source + inlier_error(&mut stream),
                (PairKind::NearMiss, NearMiss::Random) => truth * source + miss(&mut stream),
                (PairKind::NearMiss, NearMiss::Coherent) => second * source + noise(&mut stream) * SECOND_SIGMA,
                (PairKind::Outlier, _) => truth * on_surface(&mut stream),
            };
            (narrow(&source.coords), narrow(&target.coords))
        };
        let (source, target) = (0..).zip(&kinds).map(pair).unzip();
        let mut stream = Stream::new(seed, 2 + self.n as u64);
        let surface = (0..N_SURFACE).map(|_| narrow(&on_surface(&mut stream).coords)).collect();
        Correspondences { source, target, kinds, truth, second, surface }
    }

    fn kinds(&self, stream: &mut Stream) -> Vec<PairKind> {
        let whole = |share: f64| (share.clamp(0.0, 1.0) * self.n as f64).round() as usize;
        let n_inliers = whole(self.inlier_share);
        let n_near = whole(self.near_miss_share).min(self.n - n_inliers);
        let mut kinds = vec![PairKind::Inlier; n_inliers];
        kinds.resize(n_inliers + n_near, PairKind::NearMiss);
        kinds.resize(self.n, PairKind::Outlier);
        for last in (1..self.n).rev() {
            kinds.swap(last, stream.below(last as u32 + 1) as usize);
        }
        kinds
    }
}

/// Returns a point on a wavy sheet around the origin that fills the extent of the surface.
fn on_surface(stream: &mut Stream) -> Point3<f64> {
    let (u, v) = (stream.between(-0.5, 0.5), stream.between(-0.5, 0.5));
    let height = 0.5 * (5.0 * u + 1.0).sin() * (4.0 * v).cos();
    Point3::new(u * SURFACE[0], v * SURFACE[1], height * SURFACE[2])
}

fn second_turn(stream: &mut Stream) -> RigidTransform {
    let axis = Unit::try_new(noise(stream), 0.0).unwrap_or_else(Vector3::z_axis);
    let angle = stream.between(SECOND_TURN_DEG[0], SECOND_TURN_DEG[1]).to_radians();
    RigidTransform::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, angle))
}

fn inlier_error(stream: &mut Stream) -> Vector3<f64> {
    let sigma = Vector3::from_fn(|_, _| INLIER_SIGMA * stream.between(INLIER_SPREAD[0], INLIER_SPREAD[1]));
    noise(stream).component_mul(&sigma)
}

fn miss(stream: &mut Stream) -> Vector3<f64> {
    let direction = noise(stream).try_normalize(0.0).unwrap_or_else(Vector3::z);
    direction * stream.between(MISS_DISTANCE[0], MISS_DISTANCE[1])
}

/// Draws from the standard normal distribution on each axis.
fn noise(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal())
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::{angle_between, wide};

    fn scene(near_miss: NearMiss) -> CorrespondenceScene {
        CorrespondenceScene { n: 2000, inlier_share: 0.25, near_miss_share: 0.35, near_miss }
    }

    /// Errors of the pairs of one kind under a motion.
    fn errors(pairs: &Correspondences, kind: PairKind, motion: &RigidTransform) -> Vec<f64> {
        let error =
            |i: usize| (motion * Point3::from(wide(pairs.source[i])) - Point3::from(wide(pairs.target[i]))).norm();
        (0..pairs.kinds.len()).filter(|&i| pairs.kinds[i] == kind).map(error).collect()
    }

    fn root_mean_square(errors: &[f64]) -> f64 {
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
    }

    #[test]
    fn each_kind_comes_in_its_number_and_in_no_order() {
        let pairs = scene(NearMiss::Random).generate(1);
        for (kind, expected) in [(PairKind::Inlier, 500), (PairKind::NearMiss, 700), (PairKind::Outlier, 800)] {
            assert_eq!(pairs.kinds.iter().filter(|&&k| k == kind).count(), expected);
            // A quarter of the list holds about a quarter of each kind: six standard deviations are below 65.
            let early = pairs.kinds[..500].iter().filter(|&&k| k == kind).count();
            assert!(early.abs_diff(expected / 4) < 65, "{kind:?}: {early}");
        }
        assert_eq!((pairs.source.len(), pairs.target.len(), pairs.surface.len()), (2000, 2000, 1000));
    }

    #[test]
    fn inliers_follow_the_truth() {
        let pairs = scene(NearMiss::Random).generate(2);
        // Mean square on three axes: 3 · 1.5² · (mean square of U(0.3, 1.6)) = 3 · 2.25 · 1.0433.
        let rms = root_mean_square(&errors(&pairs, PairKind::Inlier, &pairs.truth));
        assert!((rms / (3.0f64 * 2.25 * 1.0433).sqrt() - 1.0).abs() < 0.1, "{rms}");
        assert!(root_mean_square(&errors(&pairs, PairKind::Outlier, &pairs.truth)) > 80.0);
    }

    #[test]
    fn random_near_misses_are_off_by_5_to_20() {
        let pairs = scene(NearMiss::Random).generate(3);
        let misses = errors(&pairs, PairKind::NearMiss, &pairs.truth);
        // Rounding to f32 at 300 units is below 1e-4.
        assert!(misses.iter().all(|e| (5.0 - 1e-4..20.0 + 1e-4).contains(e)));
    }

    #[test]
    fn coherent_near_misses_follow_the_second_motion() {
        for seed in 0..10 {
            let pairs = scene(NearMiss::Coherent).generate(seed);
            let own = root_mean_square(&errors(&pairs, PairKind::NearMiss, &pairs.second));
            assert!((own / (4.0 * 3f64.sqrt()) - 1.0).abs() < 0.1, "{own}");
            assert!(root_mean_square(&errors(&pairs, PairKind::NearMiss, &pairs.truth)) > own);
            let angle = angle_between(&pairs.truth, &pairs.second).to_degrees();
            assert!((3.0..6.0).contains(&angle), "{angle}");
            let origin = Point3::origin();
            assert!((pairs.truth * origin - pairs.second * origin).norm() < 1e-9);
        }
    }

    #[test]
    fn odd_recipes_still_make_pairs() {
        let make = |n, inlier_share, near_miss_share| {
            CorrespondenceScene { n, inlier_share, near_miss_share, near_miss: NearMiss::Coherent }.generate(0).kinds
        };
        assert!(make(0, 0.5, 0.5).is_empty());
        assert_eq!(make(3, 9.0, 9.0), [PairKind::Inlier; 3]);
        assert_eq!(make(2, f64::NAN, -1.0), [PairKind::Outlier; 2]);
        assert_eq!(scene(NearMiss::Random).generate(5), scene(NearMiss::Random).generate(5));
    }
}
