//! The cells of a voxel grid, by their numbers.

use crate::Point;
use multiversion::multiversion;
use rayon::prelude::*;

/// The whole part of a place, in sides of a cell.
pub(super) type Cell = [i64; 3];

/// Keys that one thread makes at a time.
const KEYS_AT_A_TIME: usize = 4096;

#[inline]
pub(super) fn cell(p: &Point, leaf: f64) -> Cell {
    p.map(|v| {
        let place = f64::from(v) / leaf;
        // The floor, without a call.
        let towards_zero = place as i64;
        towards_zero - i64::from(place < towards_zero as f64)
    })
}

/// Cells as single numbers in the same order, where all of a cloud's fit.
pub(super) struct Packing {
    low: Cell,
    bits: [u32; 3],
}

impl Packing {
    /// Of a cloud between two corners; no points have none.
    pub(super) fn of((low, high): &(Point, Point), leaf: f64) -> Option<Packing> {
        let corners = Some((low, high)).filter(|(low, high)| low[0] <= high[0]);
        let (low, high) = corners.map(|(low, high)| (cell(low, leaf), cell(high, leaf)))?;
        let bits = std::array::from_fn(|k| u64::BITS - high[k].abs_diff(low[k]).leading_zeros());
        (bits.iter().sum::<u32>() <= u64::BITS).then_some(Packing { low, bits })
    }

    /// One more than the largest key, where that is not above the limit.
    pub(super) fn few_keys(&self, limit: usize) -> Option<usize> {
        let n = 1usize.checked_shl(self.bits.iter().sum())?;
        (n <= limit && n <= 1 << 31).then_some(n)
    }

    /// The keys of all points, where there are few.
    pub(super) fn keys(&self, points: &[Point], leaf: f64) -> Vec<u32> {
        let mut keys = vec![0; points.len()];
        let shifts = [self.bits[1] + self.bits[2], self.bits[2], 0];
        let low = self.low.map(|low| low as f64);
        let blocks = keys.par_chunks_mut(KEYS_AT_A_TIME).zip(points.par_chunks(KEYS_AT_A_TIME));
        blocks.for_each(|(keys, points)| small_keys(points, leaf, low, shifts, keys));
        keys
    }

    #[inline]
    pub(super) fn key(&self, cell: &Cell) -> u64 {
        // A shift by 64 comes only with a cell that is zero.
        (0..3).fold(0, |key: u64, axis| {
            key.checked_shl(self.bits[axis]).unwrap_or(0) | cell[axis].abs_diff(self.low[axis])
        })
    }
}

/// As [`Packing::key`], of keys below 2³¹.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn small_keys(points: &[Point], leaf: f64, low: [f64; 3], shifts: [u32; 3], keys: &mut [u32]) {
    for (key, point) in keys.iter_mut().zip(points) {
        // Below 2⁵³, so the difference is exact.
        let steps: [u32; 3] =
            std::array::from_fn(|axis| whole((f64::from(point[axis]) / leaf).floor() - low[axis]) as u32);
        *key = steps[0] << shifts[0] | steps[1] << shifts[1] | steps[2];
    }
}

/// A number to which smaller whole ones are added, so that the last bits are theirs.
const BEYOND: f64 = (1u64 << 52) as f64;

/// A whole number from 0 to below 2⁵² as an integer; unlike a cast it is made for many numbers side by side.
#[inline(always)]
pub(super) fn whole(number: f64) -> u64 {
    (number + BEYOND).to_bits() - BEYOND.to_bits()
}
