//! Eigen-decomposition of 3×3 scatter matrices in a fixed order.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Eigenvalues in ascending order with their unit eigenvectors.
///
/// The sign of an eigenvector means nothing; whoever needs one must settle it.
#[derive(Clone, Copy, Debug)]
pub struct SortedEigen {
    /// Ascending.
    pub values: [f64; 3],
    /// `vectors[i]` belongs to `values[i]`.
    pub vectors: [Vector3<f64>; 3],
}

/// Decomposes a symmetric matrix; only its lower triangle is read.
#[must_use]
pub fn sorted_eigen(matrix: &Matrix3<f64>) -> SortedEigen {
    let eigen = SymmetricEigen::new(*matrix);
    let mut order = [0usize, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    SortedEigen {
        values: order.map(|i| eigen.eigenvalues[i]),
        vectors: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_ascend_and_vectors_solve_the_equation() {
        let m = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 1.0);
        let e = sorted_eigen(&m);
        assert!(e.values[0] <= e.values[1] && e.values[1] <= e.values[2]);
        for (value, vector) in e.values.iter().zip(&e.vectors) {
            assert!((m * vector - vector * *value).norm() < 1e-12);
        }
    }
}
