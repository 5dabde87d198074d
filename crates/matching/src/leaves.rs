//! Nearest rows of few dimensions, found by boxes around similar rows.
//!
//! The bins of a histogram are not independent: rows of 33 numbers fill a space of a few dimensions, and boxes around
//! them exclude most of the table. Queries are sorted into such leaves, too, so that those of a leaf have to examine
//! the same boxes.

use crate::Candidate;
use crate::nearest::Normed;
use crate::shortlist::Shortlist;
use congruent_descriptors::Features;
use multiversion::multiversion;
use rayon::prelude::*;

/// Maximum number of rows in a leaf.
const LEAF: usize = 32;
/// Number of values in a register.
const LANES: usize = 8;
/// Maximum number of leaves of queries that one thread takes at a time.
const LEAVES_AT_A_TIME: usize = 4;
/// Maximum number of rows from whose spread the dimension of a cut is chosen.
const LOOKED_AT: usize = 256;

/// A table whose rows have been sorted into leaves.
pub(crate) struct Leaves<'a> {
    features: &'a Features,
    /// Squared norms of the rows.
    norms: Vec<f32>,
    largest_norm: f32,
    leaves: Vec<Leaf>,
}

/// A group of similar rows.
struct Leaf {
    rows: Vec<u32>,
    /// The bounding box of the rows; unbounded in dimensions that only fill the last register.
    low: Vec<f32>,
    high: Vec<f32>,
    /// One dimension at a time, [`LEAF`] numbers of each; infinite where there is no row.
    columns: Vec<f32>,
}

impl<'a> Leaves<'a> {
    pub(crate) fn new(rows: Normed<'a>) -> Self {
        let largest_norm = rows.largest_norm();
        let Normed { features, norms } = rows;
        let mut rows: Vec<u32> = (0..features.len() as u32).collect();
        let mut leaves = Vec::new();
        cut(features, &mut rows, &mut |rows| leaves.push(Leaf::new(features, rows)));
        Leaves { features, largest_norm, norms, leaves }
    }

    /// Returns, for each row of the queries, the `k` nearest rows of this table.
    pub(crate) fn nearest_k(&self, queries: &Leaves<'_>, k: usize) -> Vec<Vec<Candidate>> {
        let mut found = vec![Vec::new(); queries.features.len()];
        let workplace = || Workplace {
            others: Vec::with_capacity(self.leaves.len()),
            place: padded(&vec![0.0; queries.features.dim], 0.0),
            list: Shortlist::among(queries.features.dim, self.largest_norm, k),
        };
        let of_block = |workplace: &mut _, block| self.nearest_of_block(queries, block, workplace);
        let by_leaf: Vec<Vec<Vec<Candidate>>> =
            queries.leaves.par_iter().with_max_len(LEAVES_AT_A_TIME).map_init(workplace, of_block).collect();
        for (block, nearest) in queries.leaves.iter().zip(by_leaf) {
            block.rows.iter().zip(nearest).for_each(|(&row, nearest)| found[row as usize] = nearest);
        }
        found
    }

    fn nearest_of_block<'b>(
        &'b self,
        queries: &Leaves<'_>,
        block: &Leaf,
        Workplace { others, place, list }: &mut Workplace<'b>,
    ) -> Vec<Vec<Candidate>> {
        // The most similar leaf first; the distance between the boxes tells which leaves can be skipped.
        others.clear();
        others.extend(
            self.leaves.iter().map(|leaf| (middles_sq(block, leaf), gap_sq((&block.low, &block.high), leaf), leaf)),
        );
        others.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = |&row: &u32| {
            let query = queries.features.row(row as usize);
            place[..query.len()].copy_from_slice(query);
            list.begin(queries.norms[row as usize]);
            let mut distances = [0.0; LEAF];
            for (_, between, leaf) in &*others {
                // The error of every sum of squares is within the margin that the limit includes.
                let limit = list.limit();
                if *between > limit || gap_sq((place, place), leaf) > limit {
                    continue;
                }
                if distances_sq(query, &leaf.columns, limit, &mut distances) {
                    list.take(distances.iter().copied().zip(leaf.rows.iter().copied()));
                }
            }
            list.settle(query, self.features)
        };
        block.rows.iter().map(nearest).collect()
    }
}

/// Buffers that a thread reuses from query to query.
struct Workplace<'a> {
    /// For each leaf of the table, its dissimilarity to the block and the distance between the boxes.
    others: Vec<(f32, f32, &'a Leaf)>,
    /// The query, padded to whole registers.
    place: Vec<f32>,
    list: Shortlist,
}

impl Leaf {
    fn new(features: &Features, rows: &[u32]) -> Self {
        let of = |row: &u32| features.row(*row as usize);
        let mut low = padded(&vec![f32::INFINITY; features.dim], f32::NEG_INFINITY);
        let mut high = padded(&vec![f32::NEG_INFINITY; features.dim], f32::INFINITY);
        let mut columns = vec![f32::INFINITY; features.dim * LEAF];
        for (place, row) in rows.iter().map(of).enumerate() {
            for (dim, &value) in row.iter().enumerate() {
                low[dim] = low[dim].min(value);
                high[dim] = high[dim].max(value);
                columns[dim * LEAF + place] = value;
            }
        }
        Leaf { rows: rows.to_vec(), low, high, columns }
    }
}

/// Pads a row to whole registers.
fn padded(row: &[f32], with: f32) -> Vec<f32> {
    let mut padded = row.to_vec();
    padded.resize(row.len().next_multiple_of(LANES), with);
    padded
}

/// Halves the rows along the dimension in which they spread most, until few enough are left.
fn cut(features: &Features, rows: &mut [u32], take: &mut impl FnMut(&[u32])) {
    if rows.len() <= LEAF {
        return take(rows);
    }
    let dim = widest(features, rows);
    let value = |row: &u32| features.row(*row as usize)[dim];
    // Whole leaves on the left, so that few leaves are half empty.
    let half = (rows.len() / 2).next_multiple_of(LEAF).min(rows.len() - 1);
    rows.select_nth_unstable_by(half, |a, b| value(a).total_cmp(&value(b)).then(a.cmp(b)));
    let (left, right) = rows.split_at_mut(half);
    cut(features, left, take);
    cut(features, right, take);
}

/// Returns the dimension in which a sample of the rows varies most.
fn widest(features: &Features, rows: &[u32]) -> usize {
    let (mut sums, mut squares) = (vec![0.0f32; features.dim], vec![0.0f32; features.dim]);
    let some = rows.iter().step_by(rows.len().div_ceil(LOOKED_AT));
    let n = some.len() as f32;
    for row in some {
        for ((sum, square), &value) in sums.iter_mut().zip(&mut squares).zip(features.row(*row as usize)) {
            *sum += value;
            *square += value * value;
        }
    }
    let spread = |dim: usize| squares[dim] - sums[dim] * sums[dim] / n;
    (0..features.dim).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(0)
}

/// Returns the squared distance between the centres of two boxes, times four.
fn middles_sq(a: &Leaf, b: &Leaf) -> f32 {
    let middles = a.low.iter().zip(&a.high).zip(b.low.iter().zip(&b.high));
    middles.map(|((al, ah), (bl, bh))| (al + ah - bl - bh).powi(2)).filter(|sq| sq.is_finite()).sum()
}

/// Returns the squared distance between a box and that of a leaf, both padded to whole registers.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn gap_sq((low, high): (&[f32], &[f32]), leaf: &Leaf) -> f32 {
    let mut sums = [0.0f32; LANES];
    let own = low.chunks_exact(LANES).zip(high.chunks_exact(LANES));
    for ((low, high), (leaf_low, leaf_high)) in own.zip(leaf.low.chunks_exact(LANES).zip(leaf.high.chunks_exact(LANES)))
    {
        for lane in 0..LANES {
            let gap = (leaf_low[lane] - high[lane]).max(low[lane] - leaf_high[lane]).max(0.0);
            sums[lane] += gap * gap;
        }
    }
    sums.iter().sum()
}

/// Computes the squared distances to the rows of a leaf, and returns whether any is at most `limit`.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn distances_sq(query: &[f32], columns: &[f32], limit: f32, distances: &mut [f32; LEAF]) -> bool {
    let mut sums = [0.0f32; LEAF];
    for (value, column) in query.iter().zip(columns.chunks_exact(LEAF)) {
        for (sum, other) in sums.iter_mut().zip(column) {
            *sum += (value - other) * (value - other);
        }
    }
    *distances = sums;
    sums.iter().fold(false, |any, sum| any | (*sum <= limit))
}
