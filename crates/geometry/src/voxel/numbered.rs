//! Which of the occupied cells contains a point.

use crate::Point;
use multiversion::multiversion;
use rayon::prelude::*;

/// Number of keys that one thread looks up at a time.
const KEYS_AT_A_TIME: usize = 1 << 17;

/// The occupied cells, numbered consecutively from zero in their order.
pub(super) struct Numbered {
    /// Cell number of each point.
    pub(super) of_points: Vec<u32>,
    /// Number of cells.
    pub(super) n_cells: usize,
}

impl Numbered {
    /// Numbers the cells by sorting them, or keys in the order of the cells.
    pub(super) fn by_sorting<K: Ord + Copy + Send + Sync>(
        points: &[Point],
        key: impl Fn(&Point) -> K + Send + Sync,
    ) -> Numbered {
        let mut members: Vec<(K, u32)> = points.par_iter().map(key).zip(0..number(points.len())).collect();
        members.par_sort_unstable();
        let mut numbered = Numbered { of_points: vec![0; points.len()], n_cells: 0 };
        for members in members.chunk_by(|a, b| a.0 == b.0) {
            members.iter().for_each(|&(_, i)| numbered.of_points[i as usize] = number(numbered.n_cells));
            numbered.n_cells += 1;
        }
        numbered
    }
}

fn number(n: usize) -> u32 {
    u32::try_from(n).expect("a cloud has fewer than 2^32 points")
}

/// Returns the number of different keys.
pub(super) fn distinct<K: Ord + Send + Sync>(points: &[Point], key: impl Fn(&Point) -> K + Send + Sync) -> usize {
    let mut keys: Vec<K> = points.par_iter().map(key).collect();
    keys.par_sort_unstable();
    keys.chunk_by(|a, b| a == b).count()
}

/// One bit for each possible key: whether it occurs.
pub(super) struct Marks(Vec<u64>);

impl Marks {
    /// Marks keys below `n_keys`.
    pub(super) fn new(keys: &[u32], n_keys: usize) -> Marks {
        let mut words = vec![0u64; n_keys.div_ceil(64)];
        for key in keys {
            words[(key / 64) as usize] |= 1 << (key % 64);
        }
        Marks(words)
    }

    /// Returns the number of different keys.
    pub(super) fn count(&self) -> usize {
        count(&self.0)
    }

    /// Replaces the keys, one per point, by the numbers of their cells.
    pub(super) fn numbered(&self, mut keys: Vec<u32>) -> Numbered {
        let mut before = vec![0; self.0.len()];
        let n_cells = count_before(&self.0, &mut before) as usize;
        keys.par_chunks_mut(KEYS_AT_A_TIME).for_each(|keys| number_keys(keys, &self.0, &before));
        Numbered { of_points: keys, n_cells }
    }
}

#[multiversion(targets("x86_64+popcnt", "aarch64+neon"))]
fn count(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

/// Counts the marks before each word, and returns the number of all marks.
#[multiversion(targets("x86_64+popcnt", "aarch64+neon"))]
fn count_before(words: &[u64], before: &mut [u32]) -> u32 {
    let mut n = 0;
    for (before, word) in before.iter_mut().zip(words) {
        *before = n;
        n += word.count_ones();
    }
    n
}

/// Replaces each key by the number of marks before its own; `before` is that number for the first key of each word.
#[multiversion(targets("x86_64+popcnt", "aarch64+neon"))]
fn number_keys(keys: &mut [u32], words: &[u64], before: &[u32]) {
    for key in keys {
        let (word, bit) = ((*key / 64) as usize, *key % 64);
        *key = before[word] + (words[word] & ((1 << bit) - 1)).count_ones();
    }
}
