//! Nearest rows by blocked matrix products.

use crate::Candidate;
use crate::nearest::Normed;
use crate::shortlist::Shortlist;
use multiversion::multiversion;
use rayon::prelude::*;

/// Number of queries that share one product.
const QUERY_BLOCK: usize = 256;
/// Number of rows of the table that share one product: the block of distances stays in the second-level cache.
const TABLE_BLOCK: usize = 512;
/// Number of distances examined together: most of the time none is small enough.
const GLANCE: usize = 32;

/// Finds nearest rows as [`nearest_k`](crate::nearest_k) does, in tables that are not empty.
pub(crate) fn nearest_k(queries: &Normed<'_>, table: &Normed<'_>, k: usize) -> Vec<Vec<Candidate>> {
    let search = Search { table, largest_norm: table.largest_norm(), k };
    let blocks = queries.features.rows.par_chunks(QUERY_BLOCK * table.features.dim);
    let blocks = blocks.zip(queries.norms.par_chunks(QUERY_BLOCK));
    blocks.flat_map_iter(|(block, norms)| search.nearest(block, norms)).collect()
}

/// A search of the whole table.
struct Search<'a> {
    table: &'a Normed<'a>,
    largest_norm: f32,
    k: usize,
}

impl Search<'_> {
    /// Returns the nearest rows for each of some queries with these squared norms.
    fn nearest(&self, block: &[f32], norms: &[f32]) -> Vec<Vec<Candidate>> {
        let Normed { features: table, norms: table_norms } = self.table;
        let dim = table.dim;
        let shortlist = |&norm: &f32| {
            let mut list = Shortlist::among(dim, self.largest_norm, self.k);
            list.begin(norm);
            list
        };
        let mut shortlists: Vec<Shortlist> = norms.iter().map(shortlist).collect();
        let mut products = vec![0.0f32; shortlists.len() * TABLE_BLOCK];
        for (number, rows) in table.rows.chunks(TABLE_BLOCK * dim).enumerate() {
            let width = rows.len() / dim;
            let first = number * TABLE_BLOCK;
            multiply(shortlists.len(), width, dim, block, rows, &mut products);
            for ((shortlist, &norm), dots) in shortlists.iter_mut().zip(norms).zip(products.chunks_exact(width)) {
                offer(shortlist, norm, first, dots, &table_norms[first..first + width]);
            }
        }
        block.chunks_exact(dim).zip(&mut shortlists).map(|(query, list)| list.settle(query, table)).collect()
    }
}

fn offer(shortlist: &mut Shortlist, query_norm: f32, first: usize, dots: &[f32], norms: &[f32]) {
    let glances = dots.chunks(GLANCE).zip(norms.chunks(GLANCE)).zip((first..).step_by(GLANCE));
    for ((dots, norms), first) in glances {
        if any_within(query_norm, dots, norms, shortlist.limit()) {
            let distances = dots.iter().zip(norms).map(|(&dot, &norm)| distance_sq(query_norm, dot, norm));
            shortlist.take(distances.zip(first as u32..));
        }
    }
}

#[inline(always)]
fn distance_sq(query_norm: f32, dot: f32, norm: f32) -> f32 {
    query_norm + norm - 2.0 * dot
}

/// Returns whether any of the distances is at most `limit`.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn any_within(query_norm: f32, dots: &[f32], norms: &[f32], limit: f32) -> bool {
    dots.iter().zip(norms).fold(false, |any, (dot, norm)| any | (distance_sq(query_norm, *dot, *norm) <= limit))
}

/// Computes `products[i][j] = queries[i] · rows[j]`, row-major with `width` columns.
fn multiply(height: usize, width: usize, dim: usize, queries: &[f32], rows: &[f32], products: &mut [f32]) {
    assert!(queries.len() == height * dim && rows.len() == width * dim && products.len() >= height * width);
    // SAFETY: the assertion above checks the sizes that the arguments below describe, and the output overlaps neither
    // input.
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
