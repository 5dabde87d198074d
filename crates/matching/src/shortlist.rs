//! Candidates for the nearest rows, until they are settled exactly.

use crate::Candidate;
use congruent_descriptors::Features;
use rayon::prelude::*;

/// Number of exact distances summed side by side: one after the other, each addition would wait for the last.
const TOGETHER: usize = 8;
/// Number of partial sums of a norm.
const LANES: usize = 16;
/// Minimum number of rows whose norms one thread computes at a time.
const ROWS_AT_A_TIME: usize = 512;

/// Rows that may be among the `k` nearest, given that each squared distance is known only to within an error. Reused
/// for one query after the other.
pub(crate) struct Shortlist {
    dim: usize,
    /// Squared norm of the longest row.
    largest_norm: f32,
    /// Twice the largest error of an approximate squared distance: a row farther than this beyond the k-th best cannot
    /// be among the best.
    margin: f32,
    k: usize,
    /// Approximate squared distances of the best so far, ascending.
    best: Vec<f32>,
    rows: Vec<(f32, u32)>,
    /// Distances and rows while they are settled.
    exact: Vec<(f64, u32)>,
}

impl Shortlist {
    /// Creates a list for rows of which the longest has this squared norm.
    pub(crate) fn among(dim: usize, largest_norm: f32, k: usize) -> Self {
        let best = Vec::with_capacity(k + 1);
        Shortlist { dim, largest_norm, margin: 0.0, k, best, rows: Vec::new(), exact: Vec::new() }
    }

    /// Starts anew, for a query with this squared norm.
    pub(crate) fn begin(&mut self, query_norm: f32) {
        // A sum of n products, in any order, has an error of at most n·u times the sum of their magnitudes, u = ε/2;
        // the errors of the product and the two norms together stay below n·ε·(|a|² + |b|²). A sum of squared
        // differences has a smaller error.
        self.margin = 2.0 * (self.dim + 4) as f32 * f32::EPSILON * (query_norm + self.largest_norm);
        self.best.clear();
        self.rows.clear();
    }

    /// Returns the approximate squared distance beyond which a row is not among the nearest.
    pub(crate) fn limit(&self) -> f32 {
        if self.best.len() < self.k { f32::INFINITY } else { self.best[self.k - 1] + self.margin }
    }

    pub(crate) fn take(&mut self, rows: impl Iterator<Item = (f32, u32)>) {
        for (distance_sq, row) in rows {
            if distance_sq <= self.limit() {
                self.rows.push((distance_sq, row));
                let at = self.best.partition_point(|&b| b <= distance_sq);
                self.best.insert(at, distance_sq);
                self.best.truncate(self.k);
            }
        }
    }

    /// Returns the nearest rows by distances in `f64`; ties go to the first row.
    pub(crate) fn settle(&mut self, query: &[f32], table: &Features) -> Vec<Candidate> {
        let limit = self.limit();
        self.rows.retain(|(approximate, _)| *approximate <= limit);
        self.exact.clear();
        for some in self.rows.chunks(TOGETHER) {
            let distances_sq = squared_distances(query, some, table);
            for (&(_, row), distance_sq) in some.iter().zip(distances_sq) {
                let is_before = |known: &(f64, u32)| known.0.total_cmp(&distance_sq).then(known.1.cmp(&row)).is_lt();
                let at = self.exact.partition_point(is_before);
                self.exact.insert(at, (distance_sq, row));
                self.exact.truncate(self.k);
            }
        }
        self.exact.iter().map(|&(distance_sq, row)| Candidate { row, distance: distance_sq.sqrt() as f32 }).collect()
    }
}

/// Computes the squared distances of a query to some rows; their sums grow side by side, each in the order of
/// [`squared_distance`].
fn squared_distances(query: &[f32], some: &[(f32, u32)], table: &Features) -> [f64; TOGETHER] {
    let row = |i: usize| &table.row(some[i.min(some.len() - 1)].1 as usize)[..query.len()];
    let rows: [&[f32]; TOGETHER] = std::array::from_fn(row);
    let mut sums = [0.0; TOGETHER];
    for (i, value) in query.iter().enumerate() {
        for (sum, row) in sums.iter_mut().zip(rows) {
            *sum += (f64::from(*value) - f64::from(row[i])).powi(2);
        }
    }
    sums
}

/// Computes the squared norms of the rows, of many rows in parallel.
pub(crate) fn squared_norms(features: &Features) -> Vec<f32> {
    let rows = features.rows.par_chunks_exact(features.dim).with_min_len(ROWS_AT_A_TIME);
    rows.map(squared_norm).collect()
}

/// Computes a squared norm in lanes, whose sums are added at the end.
fn squared_norm(row: &[f32]) -> f32 {
    let (whole, rest) = row.as_chunks::<LANES>();
    let mut sums = [0.0f32; LANES];
    for lanes in whole {
        for (sum, v) in sums.iter_mut().zip(lanes) {
            *sum += v * v;
        }
    }
    sums.iter().sum::<f32>() + rest.iter().map(|v| v * v).sum::<f32>()
}

#[cfg(test)]
pub(crate) fn squared_distance(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum()
}
