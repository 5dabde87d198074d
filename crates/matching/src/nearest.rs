//! Exact nearest neighbours among rows of many dimensions, by blocked matrix products.

use congruent_descriptors::Features;
use multiversion::multiversion;
use rayon::prelude::*;

/// Queries that share one product.
const QUERY_BLOCK: usize = 128;
/// Rows of the table that share one product: the block of distances stays in the second-level cache.
const TABLE_BLOCK: usize = 512;
/// Distances that are looked at together: most of the time none is small enough.
const GLANCE: usize = 32;

/// A row of the table and its distance to the query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Row of the table.
    pub row: u32,
    /// L2 distance, evaluated in `f64`.
    pub distance: f32,
}

/// The `k` nearest rows of `table` for every row of `queries`, nearest first; equal distances are ordered by row.
/// Fewer than `k` where the table is smaller.
///
/// # Panics
/// When the two tables have rows of different length.
#[must_use]
pub fn nearest_k(queries: &Features, table: &Features, k: usize) -> Vec<Vec<Candidate>> {
    assert_eq!(queries.dim, table.dim, "descriptors of one kind");
    if k == 0 || table.is_empty() || queries.dim == 0 {
        return vec![Vec::new(); queries.len()];
    }
    let table_norms = squared_norms(table);
    queries
        .rows
        .par_chunks(QUERY_BLOCK * queries.dim)
        .flat_map_iter(|block| Search { block, table, table_norms: &table_norms, k }.run())
        .collect()
}

fn squared_norms(features: &Features) -> Vec<f32> {
    features.rows.chunks_exact(features.dim).map(|row| row.iter().map(|v| v * v).sum()).collect()
}

/// One block of queries against the whole table.
struct Search<'a> {
    block: &'a [f32],
    table: &'a Features,
    table_norms: &'a [f32],
    k: usize,
}

impl Search<'_> {
    fn run(&self) -> Vec<Vec<Candidate>> {
        let dim = self.table.dim;
        let mut shortlists: Vec<Shortlist> =
            self.block.chunks_exact(dim).map(|query| Shortlist::new(query, self.table_norms, self.k)).collect();
        let mut products = vec![0.0f32; shortlists.len() * TABLE_BLOCK];
        for (number, rows) in self.table.rows.chunks(TABLE_BLOCK * dim).enumerate() {
            let width = rows.len() / dim;
            let first = number * TABLE_BLOCK;
            multiply(shortlists.len(), width, dim, self.block, rows, &mut products);
            for (shortlist, dots) in shortlists.iter_mut().zip(products.chunks_exact(width)) {
                shortlist.offer(first, dots, &self.table_norms[first..first + width]);
            }
        }
        self.block.chunks_exact(dim).zip(shortlists).map(|(query, list)| list.settle(query, self.table)).collect()
    }
}

/// Rows that may be among the `k` nearest, given that each squared distance is only known to within an error.
struct Shortlist {
    query_norm: f32,
    /// Twice the largest error of an approximate squared distance: what is farther than this beyond the k-th best
    /// cannot belong to the best.
    margin: f32,
    k: usize,
    /// Approximate squared distances of the best so far, ascending.
    best: Vec<f32>,
    rows: Vec<(f32, u32)>,
}

impl Shortlist {
    fn new(query: &[f32], table_norms: &[f32], k: usize) -> Self {
        let query_norm: f32 = query.iter().map(|v| v * v).sum();
        let largest = table_norms.iter().fold(0.0f32, |a, &b| a.max(b));
        // A sum of n products in any order errs by at most n·u times the sum of their sizes, u = ε/2; the product and
        // the two norms together stay below n·ε·(|a|² + |b|²).
        let margin = 2.0 * (query.len() + 4) as f32 * f32::EPSILON * (query_norm + largest);
        Shortlist { query_norm, margin, k, best: Vec::with_capacity(k + 1), rows: Vec::new() }
    }

    fn limit(&self) -> f32 {
        if self.best.len() < self.k { f32::INFINITY } else { self.best[self.k - 1] + self.margin }
    }

    fn offer(&mut self, first: usize, dots: &[f32], norms: &[f32]) {
        let glances = dots.chunks(GLANCE).zip(norms.chunks(GLANCE)).zip((first..).step_by(GLANCE));
        for ((dots, norms), first) in glances {
            if any_within(self.query_norm, dots, norms, self.limit()) {
                self.take(first, dots, norms);
            }
        }
    }

    fn take(&mut self, first: usize, dots: &[f32], norms: &[f32]) {
        for (i, (dot, norm)) in dots.iter().zip(norms).enumerate() {
            let distance_sq = distance_sq(self.query_norm, *dot, *norm);
            if distance_sq <= self.limit() {
                self.rows.push((distance_sq, (first + i) as u32));
                let at = self.best.partition_point(|&b| b <= distance_sq);
                self.best.insert(at, distance_sq);
                self.best.truncate(self.k);
            }
        }
    }

    fn settle(self, query: &[f32], table: &Features) -> Vec<Candidate> {
        let limit = self.limit();
        let mut exact: Vec<(f64, u32)> = self
            .rows
            .iter()
            .filter(|(approximate, _)| *approximate <= limit)
            .map(|&(_, row)| (squared_distance(query, table.row(row as usize)), row))
            .collect();
        exact.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        exact.truncate(self.k);
        exact.iter().map(|&(distance_sq, row)| Candidate { row, distance: distance_sq.sqrt() as f32 }).collect()
    }
}

#[inline(always)]
fn distance_sq(query_norm: f32, dot: f32, norm: f32) -> f32 {
    query_norm + norm - 2.0 * dot
}

/// Whether any of the distances is at most `limit`.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn any_within(query_norm: f32, dots: &[f32], norms: &[f32], limit: f32) -> bool {
    dots.iter().zip(norms).fold(false, |any, (dot, norm)| any | (distance_sq(query_norm, *dot, *norm) <= limit))
}

fn squared_distance(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum()
}

/// `products[i][j] = queries[i] · rows[j]`, row-major with `width` columns.
fn multiply(height: usize, width: usize, dim: usize, queries: &[f32], rows: &[f32], products: &mut [f32]) {
    assert!(queries.len() == height * dim && rows.len() == width * dim && products.len() >= height * width);
    // SAFETY: the assertion above is what the sizes and strides below describe, and the output overlaps neither input.
    unsafe {
        matrixmultiply::sgemm(
            height,
            dim,
            width,
            1.0,
            queries.as_ptr(),
            dim as isize,
            1,
            rows.as_ptr(),
            1,
            dim as isize,
            0.0,
            products.as_mut_ptr(),
            width as isize,
            1,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    fn random_features(n: usize, dim: usize, seed: u64) -> Features {
        let mut stream = Stream::new(seed, 0);
        Features { keypoints: (0..n as u32).collect(), dim, rows: (0..n * dim).map(|_| stream.unit() as f32).collect() }
    }

    fn brute_force(queries: &Features, table: &Features, k: usize) -> Vec<Vec<u32>> {
        (0..queries.len())
            .map(|q| {
                let mut all: Vec<(f64, u32)> =
                    (0..table.len()).map(|t| (squared_distance(queries.row(q), table.row(t)), t as u32)).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                all.iter().take(k).map(|c| c.1).collect()
            })
            .collect()
    }

    #[test]
    fn agrees_with_brute_force() {
        for (n, m, dim, k) in [(70, 2500, 33, 2), (3, 5, 352, 2), (65, 64, 7, 5), (4, 1, 9, 3)] {
            let (queries, table) = (random_features(n, dim, 1), random_features(m, dim, 2));
            let found: Vec<Vec<u32>> =
                nearest_k(&queries, &table, k).iter().map(|c| c.iter().map(|c| c.row).collect()).collect();
            assert_eq!(found, brute_force(&queries, &table, k));
        }
    }

    #[test]
    fn near_ties_are_settled_exactly_and_true_ties_by_row() {
        // Rows so alike that the product in f32 cannot tell them apart.
        let dim = 352;
        let mut table = random_features(1, dim, 3);
        let first = table.rows.clone();
        for i in 1..50usize {
            let mut row = first.clone();
            row[i] += 1e-6 * (50 - i) as f32;
            table.rows.extend(row);
            table.keypoints.push(i as u32);
        }
        table.rows.extend_from_slice(&first);
        table.keypoints.push(50);
        let queries = Features { keypoints: vec![0], dim, rows: first };
        let found: Vec<u32> = nearest_k(&queries, &table, 5)[0].iter().map(|c| c.row).collect();
        assert_eq!(found, brute_force(&queries, &table, 5)[0]);
        assert_eq!(found[..2], [0, 50]);
    }

    #[test]
    fn empty_tables_find_nothing() {
        let (none, some) = (random_features(0, 8, 1), random_features(3, 8, 1));
        assert!(nearest_k(&none, &some, 2).is_empty());
        assert_eq!(nearest_k(&some, &none, 2), vec![Vec::new(); 3]);
    }
}
