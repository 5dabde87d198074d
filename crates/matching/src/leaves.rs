//! Nearest rows of few dimensions, by boxes around rows that are alike.
//!
//! The bins of a histogram are not independent: rows of 33 numbers fill a space of a few dimensions, and boxes around them leave
//! most of the table out. Queries are sorted into such leaves, too, so that those of a leaf have the same boxes to look at.

use crate::Candidate;
use crate::shortlist::{Shortlist, largest, squared_norms};
use congruent_descriptors::Features;
use multiversion::multiversion;
use rayon::prelude::*;

/// Rows of a leaf, at most.
const LEAF: usize = 32;
/// Numbers in a register.
const LANES: usize = 8;
/// Leaves of queries that one thread takes at a time, at most.
const LEAVES_AT_A_TIME: usize = 4;
/// Rows from whose spread the dimension of a cut is chosen.
const LOOKED_AT: usize = 256;

/// A table whose rows have been sorted into leaves.
pub(crate) struct Leaves<'a> {
    features: &'a Features,
    /// Squared lengths of the rows.
    norms: Vec<f32>,
    largest_norm: f32,
    leaves: Vec<Leaf>,
}

/// Rows that are alike.
struct Leaf {
    rows: Vec<u32>,
    /// The box that they are in; open in dimensions that only fill the last register.
    low: Vec<f32>,
    high: Vec<f32>,
    /// A dimension at a time, [`LEAF`] numbers of each; infinite where there is no row.
    columns: Vec<f32>,
}

impl<'a> Leaves<'a> {
    pub(crate) fn new(features: &'a Features) -> Self {
        let norms = squared_norms(features);
        let mut rows: Vec<u32> = (0..features.len() as u32).collect();
        let mut leaves = Vec::new();
        cut(features, &mut rows, &mut |rows| leaves.push(Leaf::new(features, rows)));
        Leaves { features, largest_norm: largest(&norms), norms, leaves }
    }

    /// For each row of the queries the `k` nearest rows of this table.
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
        // The leaf that is most alike first; how far the boxes are from each other says which need no look.
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
                // No sum of squares errs by more than the margin that is in the limit.
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

/// What a thread uses again from query to query.
struct Workplace<'a> {
    /// The table's leaves by how much they are like the block; how far the boxes are apart.
    others: Vec<(f32, f32, &'a Leaf)>,
    /// The query, as long as registers are.
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

/// As long as registers are.
fn padded(row: &[f32], with: f32) -> Vec<f32> {
    let mut padded = row.to_vec();
    padded.resize(row.len().next_multiple_of(LANES), with);
    padded
}

/// Halves the rows where they spread most, until few enough are left.
fn cut(features: &Features, rows: &mut [u32], take: &mut impl FnMut(&[u32])) {
    if rows.len() <= LEAF {
        return take(rows);
    }
    let dim = widest(features, rows);
    let value = |row: &u32| features.row(*row as usize)[dim];
    // Whole leaves on the left, so that few are half empty.
    let half = (rows.len() / 2).next_multiple_of(LEAF).min(rows.len() - 1);
    rows.select_nth_unstable_by(half, |a, b| value(a).total_cmp(&value(b)).then(a.cmp(b)));
    let (left, right) = rows.split_at_mut(half);
    cut(features, left, take);
    cut(features, right, take);
}

/// The dimension in which some of the rows vary most.
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

/// Squared distance between the middles of two boxes, times four.
fn middles_sq(a: &Leaf, b: &Leaf) -> f32 {
    let middles = a.low.iter().zip(&a.high).zip(b.low.iter().zip(&b.high));
    middles.map(|((al, ah), (bl, bh))| (al + ah - bl - bh).powi(2)).filter(|sq| sq.is_finite()).sum()
}

/// Squared distance between a box and that of a leaf; all as long as registers are.
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

/// Squared distances to the rows of a leaf, and whether any is at most `limit`.
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
