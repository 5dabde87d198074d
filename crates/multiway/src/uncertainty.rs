//! How well the graph determines each pose.

use crate::Node;
use crate::robust::{Constraint, Part};
use crate::solve::{normal_equations, row_of};
use congruent_geometry::RigidTransform;
use nalgebra::{Matrix3, Matrix6};

/// Returns, for each scan, the root mean square error, data units, of its probe points relative to those of its
/// component's first scan, from the covariance `(Σ l JᵀΛJ)⁻¹` of all poses. `None` for a scan that stands alone, or if
/// the constraints leave a direction undetermined.
///
/// This is the effect of noise that differs from patch to patch. Systematic errors of a scanner are not included.
pub(crate) fn uncertainties(
    nodes: &[Node],
    poses: &[RigidTransform],
    components: &[Vec<usize>],
    constraints: &[Constraint],
    lines: &[f64],
) -> Vec<Option<f64>> {
    let mut all = vec![None; nodes.len()];
    for members in components.iter().filter(|members| members.len() > 1) {
        let part = Part::of(members, nodes.len(), constraints);
        let own: Vec<RigidTransform> = members.iter().map(|&node| poses[node]).collect();
        let weights: Vec<f64> = part.positions.iter().map(|&at| lines[at]).collect();
        let (hessian, _) = normal_equations(&own, &part.edges, &weights, 0);
        let Some(factor) = hessian.cholesky() else { continue };
        let covariance = factor.inverse();
        for (at, &node) in members.iter().enumerate() {
            let block = match row_of(at, 0) {
                Some(row) => covariance.fixed_view::<6, 6>(row, row).into_owned(),
                None => Matrix6::zeros(),
            };
            all[node] = Some(spread(&nodes[node], &block)).filter(|spread| spread.is_finite());
        }
    }
    all
}

/// Returns `√ mean tr(G Σ Gᵀ)` over the probe points, `G = [−[p]ₓ  I]`.
fn spread(node: &Node, covariance: &Matrix6<f64>) -> f64 {
    let turning = covariance.fixed_view::<3, 3>(0, 0);
    let mixed = covariance.fixed_view::<3, 3>(0, 3);
    let shifting = covariance.fixed_view::<3, 3>(3, 3);
    let variance = |p: &nalgebra::Vector3<f64>| {
        let cross: Matrix3<f64> = -p.cross_matrix();
        (cross * turning * cross.transpose()).trace() + 2.0 * (cross * mixed).trace() + shifting.trace()
    };
    let n = node.probes.len().max(1) as f64;
    (node.probes.iter().map(variance).sum::<f64>() / n).max(0.0).sqrt()
}
