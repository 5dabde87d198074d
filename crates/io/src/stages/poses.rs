//! Poses that were looked at, with their scores.

use super::digits;
use crate::table::csv;
use congruent_geometry::{RigidTransform, to_rows};

/// A line of a pose file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRow {
    /// By the metric; larger is better.
    pub score: f64,
    /// The trial that proposed it.
    pub trial: u64,
    /// Between file coordinates.
    pub target_from_source: RigidTransform,
}

/// Poses as CSV: `score,trial`, then the sixteen numbers of the 4×4 matrix, row by row, `m00` to `m33`.
#[must_use]
pub fn poses_csv(poses: &[PoseRow]) -> String {
    let names: Vec<String> = (0..16).map(|i| format!("m{}{}", i / 4, i % 4)).collect();
    let header: Vec<&str> = ["score", "trial"].into_iter().chain(names.iter().map(String::as_str)).collect();
    let row = |pose: &PoseRow| {
        let matrix = to_rows(&pose.target_from_source).into_iter().flatten().map(|v| digits(&v));
        [digits(&pose.score), pose.trial.to_string()].into_iter().chain(matrix).collect::<Vec<_>>()
    };
    csv(&header, poses.iter().map(row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    #[test]
    fn the_matrix_is_written_row_by_row() {
        let pose = RigidTransform::translation(0.1, -2.0, 3e6);
        let table =
            Table::parse(poses_csv(&[PoseRow { score: 1.25, trial: 9, target_from_source: pose }]).as_bytes()).unwrap();
        let (_, row) = table.rows().next().unwrap();
        assert_eq!(row[..6], [1.25, 9.0, 1.0, 0.0, 0.0, 0.1]);
        assert_eq!((table.column("m23"), row[13], row[17]), (Some(13), 3e6, 1.0));
    }
}
