//! The interface of all descriptors.

use crate::Features;
use congruent_geometry::Surface;
use rayon::prelude::*;

/// Describes the surroundings of a point by numbers that a rigid motion does not change.
///
/// Neighbours without a normal are skipped if their normal would be read. All descriptors except LFSH ignore points
/// that coincide with the keypoint.
pub trait Descriptor: Send + Sync {
    /// Returns the number of values in a row.
    fn dim(&self) -> usize;

    /// Describes one surface point into `row`, which has [`dim`](Descriptor::dim) places and is overwritten. Returns
    /// `false` if there is too little around the point; the row is then meaningless.
    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool;

    /// Describes many points in parallel: in their order, without those that could not be described. The same for any
    /// number of threads.
    fn describe(&self, surface: &Surface, keypoints: &[u32]) -> Features {
        table(self.dim(), keypoints, |keypoint, row| self.describe_into(surface, keypoint, row))
    }
}

/// Maximum number of rows that one thread fills at a time.
const ROWS_AT_A_TIME: usize = 64;

/// Fills a row for each keypoint in parallel and closes the gaps left by failures.
pub(crate) fn table(dim: usize, keypoints: &[u32], fill: impl Fn(u32, &mut [f32]) -> bool + Sync) -> Features {
    let mut rows = vec![0.0; dim * keypoints.len()];
    let parts = rows.par_chunks_exact_mut(dim).zip(keypoints).with_max_len(ROWS_AT_A_TIME);
    let valid: Vec<bool> = parts.map(|(row, &keypoint)| fill(keypoint, row)).collect();
    let mut kept = Vec::with_capacity(keypoints.len());
    for (i, &keypoint) in keypoints.iter().enumerate().filter(|&(i, _)| valid[i]) {
        rows.copy_within(i * dim..(i + 1) * dim, kept.len() * dim);
        kept.push(keypoint);
    }
    rows.truncate(kept.len() * dim);
    Features { keypoints: kept, dim, rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_failed_are_left_out_and_the_order_is_kept() {
        let features = table(2, &[8, 3, 5, 4], |keypoint, row| {
            row.fill(keypoint as f32);
            keypoint != 3
        });
        assert_eq!(features.keypoints, [8, 5, 4]);
        assert_eq!(features.rows, [8.0, 8.0, 5.0, 5.0, 4.0, 4.0]);
        assert_eq!((features.len(), features.row(1)), (3, &[5.0, 5.0][..]));
        assert!(table(2, &[], |_, _| true).is_empty() && table(2, &[1], |_, _| false).rows.is_empty());
    }
}
