//! The table of what was described.

/// One row of numbers for each described keypoint; keypoints that could not be described have none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// The surface point of each row.
    pub keypoints: Vec<u32>,
    /// Numbers in a row.
    pub dim: usize,
    /// The rows, one after the other.
    pub rows: Vec<f32>,
}

impl Features {
    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.keypoints.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.keypoints.is_empty()
    }

    /// The numbers of `keypoints[i]`.
    ///
    /// # Panics
    /// Beyond the last row.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f32] {
        &self.rows[i * self.dim..][..self.dim]
    }

    /// The given rows, in their order.
    ///
    /// # Panics
    /// Beyond the last row.
    #[must_use]
    pub fn chosen(&self, rows: &[u32]) -> Features {
        Features {
            keypoints: rows.iter().map(|&i| self.keypoints[i as usize]).collect(),
            dim: self.dim,
            rows: rows.iter().flat_map(|&i| self.row(i as usize)).copied().collect(),
        }
    }
}
