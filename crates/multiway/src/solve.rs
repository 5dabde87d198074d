//! The Levenberg–Marquardt method on SE(3).
//!
//! The normal equations are dense and factorised by Cholesky's method: with a few hundred scans that takes a second,
//! and most graphs of scans of one object are not sparse anyway.

use crate::Edge;
use crate::edge::motion_of;
use congruent_geometry::RigidTransform;
use nalgebra::{DMatrix, DVector};

/// Maximum number of steps tried.
const MAX_STEPS: usize = 100;
/// A step that lowers the cost by at most this fraction is the last one.
const TOLERANCE: f64 = 1e-9;
const FIRST_DAMPING: f64 = 1e-6;
/// Damping above which no step helps.
const MAX_DAMPING: f64 = 1e12;
/// Added to the diagonal as a fraction of its largest entry, so that directions that nothing holds stay unchanged.
const RIDGE: f64 = 1e-13;

/// Poses of least cost.
#[derive(Clone, Debug)]
pub struct Solution {
    /// For each scan, its pose in the common frame; that of the reference is unchanged.
    pub poses: Vec<RigidTransform>,
    /// The final `Σ l ξᵀΛξ`.
    pub cost: f64,
}

/// Lowers `Σ l ξᵀΛξ` over all poses except that of `reference`, from a start. Edges have the weights `l`; edges of
/// weight zero are ignored, and scans without edges stay where they are.
///
/// # Panics
/// If an edge refers to a scan that does not exist, or there are not as many weights as edges.
#[must_use]
pub fn solve(start: &[RigidTransform], edges: &[Edge], weights: &[f64], reference: usize) -> Solution {
    assert_eq!(edges.len(), weights.len(), "one weight an edge");
    let mut poses = start.to_vec();
    let mut cost = total(&poses, edges, weights);
    let mut damping = FIRST_DAMPING;
    let mut equations = None;
    for _ in 0..MAX_STEPS {
        let (hessian, gradient) = equations.get_or_insert_with(|| normal_equations(&poses, edges, weights, reference));
        let Some(step) = damped_step(hessian, gradient, damping) else { break };
        let moved = applied(&step, &poses, reference);
        let after = total(&moved, edges, weights);
        if after < cost {
            let done = cost - after <= TOLERANCE * cost;
            (poses, cost, damping, equations) = (moved, after, (damping * 0.1).max(1e-12), None);
            if done {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > MAX_DAMPING {
                break;
            }
        }
    }
    poses.iter_mut().for_each(|pose| pose.rotation.renormalize_fast());
    Solution { poses, cost }
}

fn total(poses: &[RigidTransform], edges: &[Edge], weights: &[f64]) -> f64 {
    edges.iter().zip(weights).filter(|(_, l)| **l > 0.0).map(|(edge, l)| l * edge.cost(poses)).sum()
}

/// Returns `JᵀΛJ` and `−JᵀΛξ`, without the rows of the reference.
pub(crate) fn normal_equations(
    poses: &[RigidTransform],
    edges: &[Edge],
    weights: &[f64],
    reference: usize,
) -> (DMatrix<f64>, DVector<f64>) {
    let size = 6 * poses.len().saturating_sub(1);
    let (mut hessian, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (edge, l) in edges.iter().zip(weights).filter(|(_, l)| **l > 0.0) {
        let linear = edge.linearised(poses);
        let information = edge.information * *l;
        let ends =
            [(row_of(edge.source, reference), linear.by_source), (row_of(edge.target, reference), linear.by_target)];
        for (row, by_row) in &ends {
            let Some(row) = *row else { continue };
            let left = by_row.transpose() * information;
            let mut part = gradient.fixed_rows_mut::<6>(row);
            part -= left * linear.error;
            for (column, by_column) in &ends {
                let Some(column) = *column else { continue };
                let mut block = hessian.fixed_view_mut::<6, 6>(row, column);
                block += left * by_column;
            }
        }
    }
    (hessian, gradient)
}

/// Returns the first row of a scan; the reference has none.
pub(crate) fn row_of(node: usize, reference: usize) -> Option<usize> {
    match node.cmp(&reference) {
        std::cmp::Ordering::Less => Some(6 * node),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(6 * (node - 1)),
    }
}

fn damped_step(hessian: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let largest = hessian.diagonal().iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let mut damped = hessian.clone();
    for i in 0..damped.nrows() {
        // Marquardt's scaling: rotations and translations have different units.
        damped[(i, i)] += damping * hessian[(i, i)] + RIDGE * largest;
    }
    damped.cholesky().map(|factor| factor.solve(gradient)).filter(|step| step.iter().all(|v| v.is_finite()))
}

fn applied(step: &DVector<f64>, poses: &[RigidTransform], reference: usize) -> Vec<RigidTransform> {
    let moved = |(node, pose): (usize, &RigidTransform)| match row_of(node, reference) {
        Some(row) => pose * motion_of(&step.fixed_rows::<6>(row).into_owned()),
        None => *pose,
    };
    poses.iter().enumerate().map(moved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{moved_apart, ring};
    use nalgebra::{Matrix6, Vector3, Vector6};

    #[test]
    fn exact_edges_are_met_from_a_rough_start() {
        let ring = ring(12, 0.0);
        let start: Vec<RigidTransform> =
            ring.truth.iter().enumerate().map(|(i, pose)| pose * moved_apart(i as u64, 3.0, 0.2)).collect();
        let start = [&ring.truth[..1], &start[1..]].concat();
        let solution = solve(&start, &ring.edges, &vec![1.0; ring.edges.len()], 0);
        assert!(solution.cost < 1e-12, "{}", solution.cost);
        for (pose, truth) in solution.poses.iter().zip(&ring.truth) {
            assert!((pose.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-6);
        }
    }

    /// Two measurements of one translation: the optimum is their mean, weighted by the information.
    #[test]
    fn two_edges_meet_at_their_weighted_mean() {
        let edge = |shift: f64, information: f64| Edge {
            source: 1,
            target: 0,
            target_from_source: RigidTransform::translation(shift, 0.0, 0.0),
            information: Matrix6::identity() * information,
        };
        let edges = [edge(1.0, 3.0), edge(2.0, 1.0)];
        for (weights, expected) in [([1.0, 1.0], 1.25), ([1.0, 3.0], 1.5), ([0.0, 1.0], 2.0)] {
            let solution = solve(&[RigidTransform::identity(); 2], &edges, &weights, 0);
            let found = solution.poses[1].translation.vector;
            assert!((found - Vector3::new(expected, 0.0, 0.0)).norm() < 1e-9, "{weights:?}: {found}");
        }
    }

    #[test]
    fn neither_the_frame_nor_the_fixed_scan_matters() {
        let ring = ring(9, 1.0);
        let weights = vec![1.0; ring.edges.len()];
        let relative = |poses: &[RigidTransform]| -> Vec<RigidTransform> {
            poses.iter().map(|pose| poses[4].inverse() * pose).collect()
        };
        let one = solve(&ring.truth, &ring.edges, &weights, 0);
        let frame = moved_apart(5, 40.0, 1.0);
        let elsewhere: Vec<RigidTransform> = ring.truth.iter().map(|pose| frame * pose).collect();
        let other = solve(&elsewhere, &ring.edges, &weights, 7);
        assert!((one.cost - other.cost).abs() < 1e-6 * one.cost);
        for (a, b) in relative(&one.poses).iter().zip(&relative(&other.poses)) {
            assert!((a.to_homogeneous() - b.to_homogeneous()).norm() < 1e-4);
        }
    }

    #[test]
    fn the_optimum_has_no_slope() {
        let ring = ring(9, 1.0);
        let weights = vec![1.0; ring.edges.len()];
        let best = solve(&ring.truth, &ring.edges, &weights, 0);
        for node in 1..9 {
            for axis in 0..6 {
                for size in [1e-3, -1e-3] {
                    let mut moved = best.poses.clone();
                    moved[node] *= motion_of(&Vector6::ith(axis, size));
                    assert!(total(&moved, &ring.edges, &weights) > best.cost, "node {node}, axis {axis}");
                }
            }
        }
    }

    #[test]
    fn nothing_to_solve_is_fine() {
        assert!(solve(&[], &[], &[], 0).poses.is_empty());
        let alone = [RigidTransform::translation(1.0, 2.0, 3.0)];
        assert_eq!(solve(&alone, &[], &[], 0).poses, alone);
        let loose = [alone[0], RigidTransform::identity()];
        assert_eq!(solve(&loose, &[], &[], 0).poses, loose);
    }
}
