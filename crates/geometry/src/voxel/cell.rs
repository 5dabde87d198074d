//! The cells of a voxel grid, by their numbers.

use crate::Point;
use multiversion::multiversion;
use rayon::prelude::*;

/// The whole part of a place, in sides of a cell.
pub(super) type Cell = [i64; 3];

/// Points whose cells one thread numbers at a time.
const NUMBERS_AT_A_TIME: usize = 1 << 15;

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
    /// Cells along each axis.
    size: [u64; 3],
    bits: [u32; 3],
}

impl Packing {
    /// Of a cloud between two corners; no points have none.
    pub(super) fn of((low, high): &(Point, Point), leaf: f64) -> Option<Packing> {
        let corners = Some((low, high)).filter(|(low, high)| low[0] <= high[0]);
        let (low, high) = corners.map(|(low, high)| (cell(low, leaf), cell(high, leaf)))?;
        let last: [u64; 3] = std::array::from_fn(|k| high[k].abs_diff(low[k]));
        let (size, bits) = (last.map(|last| last.saturating_add(1)), last.map(|last| u64::BITS - last.leading_zeros()));
        (bits.iter().sum::<u32>() <= u64::BITS).then_some(Packing { low, size, bits })
    }

    /// How many cells the cloud's box has, where they are not more than the limit.
    pub(super) fn few_cells(&self, limit: usize) -> Option<usize> {
        let n = self.size.iter().try_fold(1usize, |n, &size| n.checked_mul(usize::try_from(size).ok()?))?;
        (n <= limit && n <= 1 << 31).then_some(n)
    }

    /// The numbers of the cells of all points among those of the box, where these are few.
    pub(super) fn numbers(&self, points: &[Point], leaf: f64) -> Vec<u32> {
        let mut numbers = vec![0; points.len()];
        let steps = [self.size[1] * self.size[2], self.size[2], 1].map(|step| step as u32);
        let low = self.low.map(|low| low as f64);
        let blocks = numbers.par_chunks_mut(NUMBERS_AT_A_TIME).zip(points.par_chunks(NUMBERS_AT_A_TIME));
        blocks.for_each(|(numbers, points)| number_cells(points, leaf, low, steps, numbers));
        numbers
    }

    #[inline]
    pub(super) fn key(&self, cell: &Cell) -> u64 {
        // A shift by 64 comes only with a cell that is zero.
        (0..3).fold(0, |key: u64, axis| {
            key.checked_shl(self.bits[axis]).unwrap_or(0) | cell[axis].abs_diff(self.low[axis])
        })
    }
}

/// Of a box of at most 2³¹ cells, whose numbers grow by so many steps along each axis.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn number_cells(points: &[Point], leaf: f64, low: [f64; 3], steps: [u32; 3], numbers: &mut [u32]) {
    for (number, point) in numbers.iter_mut().zip(points) {
        // Below 2⁵³, so the difference is exact.
        let [x, y, z]: [u32; 3] =
            std::array::from_fn(|axis| whole((f64::from(point[axis]) / leaf).floor() - low[axis]) as u32);
        *number = x * steps[0] + y * steps[1] + z;
    }
}

/// A number to which smaller whole ones are added, so that the last bits are theirs.
const BEYOND: f64 = (1u64 << 52) as f64;

/// A whole number from 0 to below 2⁵² as an integer; unlike a cast it is made for many numbers side by side.
#[inline(always)]
pub(super) fn whole(number: f64) -> u64 {
    (number + BEYOND).to_bits() - BEYOND.to_bits()
}
