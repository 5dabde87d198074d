//! One constraint of the graph, and its derivatives.

use congruent_geometry::RigidTransform;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Angle below which the constant term of the series for the Jacobian's last coefficient is exact to `f64`.
const SMALL_ANGLE: f64 = 1e-4;

/// A measured pose between two scans.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Position of the scan that is moved.
    pub source: usize,
    /// Position of the scan that it is moved onto.
    pub target: usize,
    /// The measured pose.
    pub target_from_source: RigidTransform,
    /// Inverse covariance of a small motion of the source in the target's frame, rotation before translation.
    pub information: Matrix6<f64>,
}

/// The error of an edge and how it changes with the two poses.
pub(crate) struct Linearised {
    pub(crate) error: Vector6<f64>,
    pub(crate) by_source: Matrix6<f64>,
    pub(crate) by_target: Matrix6<f64>,
}

impl Edge {
    /// Returns the motion (rotation vector, then translation) in the target's frame that leads from the measured pose
    /// of the source to the one given by the poses: `E = X_t⁻¹ X_s M⁻¹`.
    #[must_use]
    pub fn error(&self, poses: &[RigidTransform]) -> Vector6<f64> {
        vector_of(&self.difference(poses))
    }

    /// Returns `ξᵀ Λ ξ`.
    #[must_use]
    pub fn cost(&self, poses: &[RigidTransform]) -> f64 {
        let error = self.error(poses);
        error.dot(&(self.information * error))
    }

    /// Returns the information for a small motion of the source in its own frame (`X ← X exp(δ)`), rotation before
    /// translation, where that frame is a different one: `scan_from_frame` leads from it to the source's.
    #[must_use]
    pub fn information_in_source(&self, scan_from_frame: &RigidTransform) -> Matrix6<f64> {
        let change = adjoint(&(self.target_from_source * scan_from_frame));
        change.transpose() * self.information * change
    }

    fn difference(&self, poses: &[RigidTransform]) -> RigidTransform {
        poses[self.target].inverse() * poses[self.source] * self.target_from_source.inverse()
    }

    /// Returns the derivatives with respect to changes of poses in their own frames, `X ← X exp(δ)`.
    pub(crate) fn linearised(&self, poses: &[RigidTransform]) -> Linearised {
        let difference = self.difference(poses);
        let error = vector_of(&difference);
        let omega: Vector3<f64> = error.fixed_rows::<3>(0).into_owned();
        // E(δ_t, δ_s) = exp(−δ_t) E exp(Ad_M δ_s), exactly.
        let mut by_target = Matrix6::zeros();
        by_target.fixed_view_mut::<3, 3>(0, 0).copy_from(&-inverse_jacobian(&omega));
        by_target.fixed_view_mut::<3, 3>(3, 0).copy_from(&difference.translation.vector.cross_matrix());
        by_target.fixed_view_mut::<3, 3>(3, 3).copy_from(&-Matrix3::identity());
        let mut by_motion = Matrix6::zeros();
        by_motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&inverse_jacobian(&-omega));
        by_motion.fixed_view_mut::<3, 3>(3, 3).copy_from(difference.rotation.to_rotation_matrix().matrix());
        Linearised { error, by_source: by_motion * adjoint(&self.target_from_source), by_target }
    }
}

/// Returns the rotation vector, then the translation.
pub(crate) fn vector_of(motion: &RigidTransform) -> Vector6<f64> {
    let (turn, shift) = (motion.rotation.scaled_axis(), motion.translation.vector);
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// Returns the motion with this rotation vector and translation.
pub(crate) fn motion_of(vector: &Vector6<f64>) -> RigidTransform {
    RigidTransform::new(vector.fixed_rows::<3>(3).into_owned(), vector.fixed_rows::<3>(0).into_owned())
}

/// Returns the adjoint `Ad_M`, with `M exp(ξ) M⁻¹ = exp(Ad_M ξ)` to first order.
pub(crate) fn adjoint(motion: &RigidTransform) -> Matrix6<f64> {
    let rotation = *motion.rotation.to_rotation_matrix().matrix();
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&(motion.translation.vector.cross_matrix() * rotation));
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    adjoint
}

/// Returns how a rotation vector changes with a small rotation from the left (the inverse left Jacobian of SO(3)).
fn inverse_jacobian(omega: &Vector3<f64>) -> Matrix3<f64> {
    let angle = omega.norm();
    let square_term = if angle < SMALL_ANGLE {
        1.0 / 12.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    let cross = omega.cross_matrix();
    Matrix3::identity() - cross * 0.5 + cross * cross * square_term
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    fn any_motion(stream: &mut Stream) -> RigidTransform {
        let shift = Vector3::from_fn(|_, _| stream.between(-5.0, 5.0));
        RigidTransform::from_parts(shift.into(), stream.rotation())
    }

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        let mut stream = Stream::new(1, 0);
        let step = 1e-6;
        for _ in 0..20 {
            let poses = [any_motion(&mut stream), any_motion(&mut stream)];
            let measured = any_motion(&mut stream);
            let edge = Edge { source: 0, target: 1, target_from_source: measured, information: Matrix6::identity() };
            let exact = edge.linearised(&poses);
            for (node, jacobian) in [(0, exact.by_source), (1, exact.by_target)] {
                for axis in 0..6 {
                    let at = |size: f64| {
                        let mut moved = poses;
                        moved[node] *= motion_of(&(Vector6::ith(axis, size)));
                        edge.error(&moved)
                    };
                    let difference = (at(step) - at(-step)) / (2.0 * step);
                    let off = (difference - jacobian.column(axis)).norm();
                    assert!(off < 1e-5 * (1.0 + jacobian.norm()), "node {node}, axis {axis}: off by {off}");
                }
            }
        }
    }

    #[test]
    fn an_edge_that_holds_has_no_error() {
        let mut stream = Stream::new(2, 0);
        let poses = [any_motion(&mut stream), any_motion(&mut stream)];
        let held = poses[1].inverse() * poses[0];
        let edge = Edge { source: 0, target: 1, target_from_source: held, information: Matrix6::identity() };
        assert!(edge.cost(&poses) < 1e-20);
    }
}
