//! The rigid motion that fits pairs of points best in the least-squares sense.

use crate::RigidTransform;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A triangle is degenerate if twice its area is at most this fraction of its longest edge squared.
const MIN_DOUBLE_AREA: f64 = 2e-6;
/// Pairs are degenerate if the second singular value of their correlation is at most this fraction of the first.
const MIN_SINGULAR_RATIO: f64 = 1e-9;

/// Returns the least-squares motion for three pairs, in closed form.
///
/// The best rotation maps the plane of one triangle onto the plane of the other with the corners in the same order,
/// which leaves one angle in that plane. Exact even if the triangles are not congruent. `None` if either triangle is
/// too thin to be used.
#[must_use]
pub fn fit_three(source: &[Vector3<f64>; 3], target: &[Vector3<f64>; 3]) -> Option<RigidTransform> {
    let (from, to) = (Frame::of(source)?, Frame::of(target)?);
    let (mut cos, mut sin) = (0.0, 0.0);
    for i in 0..3 {
        let (a, b) = (from.in_plane(&source[i]), to.in_plane(&target[i]));
        cos += a.0 * b.0 + a.1 * b.1;
        sin += a.0 * b.1 - a.1 * b.0;
    }
    let length = cos.hypot(sin);
    if length.is_nan() || length <= 0.0 {
        return None;
    }
    let (cos, sin) = (cos / length, sin / length);
    let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let rotation = to.axes * turn * from.axes.transpose();
    Some(with_centres(&rotation, &from.centre, &to.centre))
}

/// Returns the least-squares motion for weighted pairs `(source, target, weight)` (Kabsch, Umeyama).
///
/// `None` for fewer than three pairs with positive weight, for collinear or coincident pairs, or if anything is not
/// finite.
#[must_use]
pub fn fit_weighted(pairs: impl IntoIterator<Item = (Vector3<f64>, Vector3<f64>, f64)>) -> Option<RigidTransform> {
    let mut pairs = pairs.into_iter().filter(|pair| pair.2 > 0.0).peekable();
    // Sums are taken relative to the first pair: far from the origin they would suffer from cancellation.
    let (near_source, near_target, _) = *pairs.peek()?;
    let (mut n, mut total, mut from, mut to) = (0, 0.0, Vector3::zeros(), Vector3::zeros());
    let mut products = Matrix3::zeros();
    for (p, q, weight) in pairs {
        let (p, q) = (p - near_source, q - near_target);
        let weighted = p * weight;
        n += 1;
        total += weight;
        from += weighted;
        to += q * weight;
        products += weighted * q.transpose();
    }
    let correlation: Matrix3<f64> = products - from * to.transpose() / total;
    if n < 3 || !total.is_finite() || !correlation.iter().all(|v| v.is_finite()) {
        return None;
    }
    let (from, to) = (near_source + from / total, near_target + to / total);
    let svd = correlation.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    if svd.singular_values[1] <= MIN_SINGULAR_RATIO * svd.singular_values[0] {
        return None;
    }
    let handedness = (v * u.transpose()).determinant().signum();
    let rotation = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * u.transpose();
    Some(with_centres(&rotation, &from, &to))
}

fn with_centres(rotation: &Matrix3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> RigidTransform {
    let translation = Translation3::from(to - rotation * from);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation));
    RigidTransform::from_parts(translation, rotation)
}

/// A triangle's centroid and axes: first edge, in-plane perpendicular, normal (right-handed, as columns).
struct Frame {
    centre: Vector3<f64>,
    axes: Matrix3<f64>,
}

impl Frame {
    fn of(corners: &[Vector3<f64>; 3]) -> Option<Frame> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a));
        let longest_sq = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        let double_area = normal.norm();
        if double_area.is_nan() || double_area <= MIN_DOUBLE_AREA * longest_sq {
            return None;
        }
        let (x, z) = ((b - a).normalize(), normal / double_area);
        Some(Frame { centre: (a + b + c) / 3.0, axes: Matrix3::from_columns(&[x, z.cross(&x), z]) })
    }

    fn in_plane(&self, point: &Vector3<f64>) -> (f64, f64) {
        let offset = point - self.centre;
        (offset.dot(&self.axes.column(0)), offset.dot(&self.axes.column(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use nalgebra::Point3;

    fn vector(stream: &mut Stream) -> Vector3<f64> {
        Vector3::new(stream.normal(), stream.normal(), stream.normal())
    }

    fn cost(motion: &RigidTransform, source: &[Vector3<f64>; 3], target: &[Vector3<f64>; 3]) -> f64 {
        source.iter().zip(target).map(|(p, q)| (motion * Point3::from(*p) - Point3::from(*q)).norm_squared()).sum()
    }

    #[test]
    fn three_pairs_are_fitted_as_well_as_by_svd() {
        let mut stream = Stream::new(11, 0);
        for _ in 0..20_000 {
            let source = std::array::from_fn(|_| vector(&mut stream));
            let target = std::array::from_fn(|_| vector(&mut stream));
            let (Some(closed), Some(svd)) =
                (fit_three(&source, &target), fit_weighted([0, 1, 2].map(|i| (source[i], target[i], 1.0))))
            else {
                continue;
            };
            let (a, b) = (cost(&closed, &source, &target), cost(&svd, &source, &target));
            assert!((a - b).abs() < 1e-9 * (1.0 + b), "{a} {b}");
        }
    }

    #[test]
    fn a_known_motion_is_recovered() {
        let mut stream = Stream::new(12, 0);
        for _ in 0..100 {
            let truth = RigidTransform::from_parts(Translation3::from(vector(&mut stream)), stream.rotation());
            let source: Vec<_> = (0..10).map(|_| vector(&mut stream)).collect();
            let target: Vec<_> = source.iter().map(|p| (truth * Point3::from(*p)).coords).collect();
            let pairs: Vec<_> = source.iter().zip(&target).map(|(p, q)| (*p, *q, stream.between(0.1, 2.0))).collect();
            let all = fit_weighted(pairs.iter().copied()).unwrap();
            assert!((all.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
            let three = fit_three(&[source[0], source[1], source[2]], &[target[0], target[1], target[2]]).unwrap();
            assert!((three.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-9);
        }
    }

    #[test]
    fn zero_weights_do_not_count() {
        let corner = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut pairs: Vec<_> = corner.iter().map(|p| (*p, *p, 1.0)).collect();
        pairs.push((Vector3::zeros(), Vector3::repeat(9.0), 0.0));
        assert!(
            (fit_weighted(pairs.iter().copied()).unwrap().to_homogeneous() - nalgebra::Matrix4::identity()).norm()
                < 1e-12
        );
    }

    #[test]
    fn degenerate_pairs_have_no_motion() {
        let line = [Vector3::zeros(), Vector3::x(), Vector3::x() * 2.0];
        let good = [Vector3::zeros(), Vector3::x(), Vector3::y()];
        let equal = [Vector3::x(); 3];
        let broken = [Vector3::repeat(f64::NAN), Vector3::x(), Vector3::y()];
        for bad in [line, equal, broken] {
            assert!(fit_three(&bad, &good).is_none() && fit_three(&good, &bad).is_none());
            assert!(fit_weighted([0, 1, 2].map(|i| (bad[i], good[i], 1.0))).is_none());
        }
        assert!(fit_weighted([]).is_none());
    }

    #[test]
    fn planar_pairs_keep_the_right_handed_solution() {
        let source = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::new(1.0, 1.0, 0.0)];
        let pairs: Vec<_> = source.iter().map(|p| (*p, Vector3::new(p.x, -p.y, 0.0), 1.0)).collect();
        let rotation = fit_weighted(pairs.iter().copied()).unwrap().rotation.to_rotation_matrix();
        assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-9);
    }
}
