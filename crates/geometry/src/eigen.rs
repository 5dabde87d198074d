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

/// The eigenvalues, ascending, and a unit eigenvector of the smallest.
pub(crate) struct Smallest {
    pub(crate) values: [f64; 3],
    pub(crate) vector: Vector3<f64>,
}

/// Where two eigenvalues are nearly the same, the closed form loses digits: the cosine that it rests on is so near to one.
const MAX_COSINE: f64 = 1.0 - 1e-6;
/// What an eigenvalue may be off, as a share of the largest.
const ROUNDING: f64 = 1e-13;
/// Where the rows of `A − λI` are this much thinner than the spread of the eigenvalues, nothing can be read off them.
const MIN_CROSS: f64 = 1e-10;

/// The same as [`sorted_eigen`] where only the smallest eigenvector is wanted: mostly in closed form (Smith 1961), several times
/// as fast, to about 1e-13 of the largest eigenvalue.
pub(crate) fn smallest_eigen(matrix: &Matrix3<f64>) -> Smallest {
    closed_form(matrix).unwrap_or_else(|| {
        let SortedEigen { values, vectors: [vector, ..] } = sorted_eigen(matrix);
        Smallest { values, vector }
    })
}

fn closed_form(matrix: &Matrix3<f64>) -> Option<Smallest> {
    let mean = matrix.trace() / 3.0;
    let apart = matrix - Matrix3::from_diagonal_element(mean);
    let spread = (apart.norm_squared() / 6.0).sqrt();
    let cosine = apart.determinant() / (2.0 * spread * spread * spread);
    // No range holds a NaN.
    if !(-MAX_COSINE..=MAX_COSINE).contains(&cosine) {
        return None;
    }
    let angle = cosine.acos() / 3.0;
    let largest = mean + 2.0 * spread * angle.cos();
    let smallest = mean + 2.0 * spread * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    // Nothing but rounding: a plane without noise has none.
    let smallest = if smallest.abs() <= ROUNDING * largest { 0.0 } else { smallest };
    let rows = matrix - Matrix3::from_diagonal_element(smallest);
    let [a, b, c] = [0, 1, 2].map(|i| rows.column(i).into_owned());
    let crosses = [a.cross(&b), a.cross(&c), b.cross(&c)];
    let vector = crosses.into_iter().max_by(|one, other| one.norm_squared().total_cmp(&other.norm_squared()))?;
    let length = vector.norm();
    let values = [smallest, 3.0 * mean - smallest - largest, largest];
    (length > MIN_CROSS * spread * spread).then_some(Smallest { values, vector: vector / length })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn values_ascend_and_vectors_solve_the_equation() {
        let m = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 1.0);
        let e = sorted_eigen(&m);
        assert!(e.values[0] <= e.values[1] && e.values[1] <= e.values[2]);
        for (value, vector) in e.values.iter().zip(&e.vectors) {
            assert!((m * vector - vector * *value).norm() < 1e-12);
        }
    }

    #[test]
    fn in_closed_form_it_is_the_same() {
        let mut stream = Stream::new(4, 0);
        for i in 0..2000 {
            let turn = *stream.rotation().to_rotation_matrix().matrix();
            let thin = 10f64.powi(-(i % 9));
            let diagonal =
                Matrix3::from_diagonal(&Vector3::new(stream.unit() * thin, stream.unit(), 1.0 + stream.unit()));
            let matrix = turn * diagonal * turn.transpose() * 10f64.powi(i % 7 - 3);
            let (all, one) = (sorted_eigen(&matrix), smallest_eigen(&matrix));
            let scale = all.values[2];
            for (a, b) in all.values.iter().zip(&one.values) {
                assert!((a - b).abs() < 1e-12 * scale, "{:?} {:?}", all.values, one.values);
            }
            let gap = (all.values[1] - all.values[0]) / scale;
            assert!(all.vectors[0].cross(&one.vector).norm() < 1e-12 / gap, "{matrix}");
        }
        for odd in [Matrix3::zeros(), Matrix3::identity() * 3.0, Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 4.0))] {
            let one = smallest_eigen(&odd);
            assert!(
                (odd * one.vector - one.vector * one.values[0]).norm() < 1e-12
                    && (one.vector.norm() - 1.0).abs() < 1e-12
            );
        }
    }
}
