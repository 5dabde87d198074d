//! The rigid motion that a written 4×4 matrix means.

use congruent_geometry::{RigidTransform, from_rows};

/// The rigid motion nearest to a matrix that somebody has written, and how near it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// The nearest rigid motion.
    pub pose: RigidTransform,
    /// How far the upper left 3×3 part is from its rotation (Frobenius norm).
    pub skew: f64,
}

/// Why a matrix is no rigid motion.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MotionFault {
    /// The last row is not `0 0 0 1`: often the matrix is transposed.
    #[error(
        "the last row is {row:?} instead of 0 0 0 1; write the matrix row by row, the translation in the last column"
    )]
    LastRow {
        /// The last row.
        row: [f64; 4],
    },
    /// The upper left 3×3 part scales, shears or mirrors, or a number is not finite.
    #[error("the upper left 3x3 part is farther than {allowed} from a rotation; remove scale, shear and mirroring")]
    NotRigid {
        /// How far it may be (Frobenius norm).
        allowed: f64,
    },
}

/// How far the last row may be from `0 0 0 1`, each number.
const LAST_ROW: f64 = 1e-3;

impl Motion {
    /// Farther from a rigid motion than this, a matrix is worth a warning: it is what six printed digits can lose, with room.
    pub const WARN_ABOVE: f64 = 1e-3;
    /// Farther than this, a truth that others have measured is none.
    pub const REFUSE_ABOVE: f64 = 0.1;

    /// From a matrix given row by row.
    ///
    /// # Errors
    /// The last row is not `0 0 0 1`, the upper left 3×3 part is farther than `allowed` from a rotation, or a number is not
    /// finite.
    pub fn nearest(rows: &[[f64; 4]; 4], allowed: f64) -> Result<Motion, MotionFault> {
        let [.., row] = *rows;
        if !row.iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(v, expected)| (v - expected).abs() <= LAST_ROW) {
            return Err(MotionFault::LastRow { row });
        }
        let pose = from_rows(rows, allowed).ok_or(MotionFault::NotRigid { allowed })?;
        let rotation = pose.rotation.to_rotation_matrix();
        let difference = |row: usize, column: usize| (rotation[(row, column)] - rows[row][column]).powi(2);
        let skew_sq: f64 = (0..3).flat_map(|row| (0..3).map(move |column| difference(row, column))).sum();
        Ok(Motion { pose, skew: skew_sq.sqrt() })
    }

    /// From the upper three rows, of a format that has no others.
    ///
    /// # Errors
    /// As [`Motion::nearest`], but for the last row.
    pub fn nearest_upper(rows: &[[f64; 4]; 3], allowed: f64) -> Result<Motion, MotionFault> {
        let [x, y, z] = *rows;
        Motion::nearest(&[x, y, z, [0.0, 0.0, 0.0, 1.0]], allowed)
    }

    /// Whether it is worth a warning.
    #[must_use]
    pub fn is_skewed(&self) -> bool {
        self.skew > Motion::WARN_ABOVE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURNED: [[f64; 4]; 4] =
        [[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]];

    #[test]
    fn a_transposed_matrix_is_refused_and_a_skewed_one_is_measured() {
        let found = Motion::nearest(&TURNED, 1e-9).unwrap();
        assert!(found.pose.translation.z == 7.0 && found.skew < 1e-12 && !found.is_skewed());
        let transposed = std::array::from_fn(|row| std::array::from_fn(|column| TURNED[column][row]));
        assert_eq!(
            Motion::nearest(&transposed, Motion::REFUSE_ABOVE),
            Err(MotionFault::LastRow { row: [5.0, 6.0, 7.0, 1.0] })
        );
        let mut skewed = TURNED;
        skewed[2][2] = 1.01;
        let found = Motion::nearest(&skewed, Motion::REFUSE_ABOVE).unwrap();
        assert!((found.skew - 0.01).abs() < 1e-9 && found.is_skewed());
        skewed[2][2] = -1.0;
        let allowed = Motion::REFUSE_ABOVE;
        assert_eq!(Motion::nearest(&skewed, allowed), Err(MotionFault::NotRigid { allowed }));
        assert_eq!(
            Motion::nearest_upper(&[TURNED[0], TURNED[1], TURNED[2]], 1e-9).unwrap(),
            Motion::nearest(&TURNED, 1e-9).unwrap()
        );
    }
}
