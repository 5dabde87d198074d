//! The table of descriptors.

/// One row of numbers for each described keypoint; keypoints that could not be described have none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// The surface point of each row.
    pub keypoints: Vec<u32>,
    /// Number of values in a row.
    pub dim: usize,
    /// The rows, one after the other.
    pub rows: Vec<f32>,
}

impl Features {
    /// Returns the number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.keypoints.len()
    }

    /// Returns whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.keypoints.is_empty()
    }

    /// Returns the values of `keypoints[i]`.
    ///
    /// # Panics
    /// If `i` is beyond the last row.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f32] {
        &self.rows[i * self.dim..][..self.dim]
    }

    /// Returns the given rows, in the given order.
    ///
    /// # Panics
    /// If any of them is beyond the last row.
    #[must_use]
    pub fn chosen(&self, rows: &[u32]) -> Features {
        Features {
            keypoints: rows.iter().map(|&i| self.keypoints[i as usize]).collect(),
            dim: self.dim,
            rows: rows.iter().flat_map(|&i| self.row(i as usize)).copied().collect(),
        }
    }
}
