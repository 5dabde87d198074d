//! The cells of a voxel grid and their numbers.

use crate::Point;
use multiversion::multiversion;
use rayon::prelude::*;

/// Coordinates in units of a cell's side, rounded down.
pub(super) type Cell = [i64; 3];

/// The size of the cells.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub(super) side: f64,
    /// Number of cells per unit of length: a product with it takes a fraction of the time of a division by the side.
    per_unit: f64,
}

impl Leaf {
    /// A side below 2⁻⁵⁰ of the largest coordinate is raised to that, since finer cells could not be numbered.
    pub(super) fn new(side: f64, (low, high): &(Point, Point)) -> Leaf {
        let largest = (0..3).fold(0.0f32, |largest, axis| largest.max(-low[axis]).max(high[axis]));
        let side = side.max(f64::from(largest) * 2f64.powi(-50)).max(SMALLEST);
        Leaf { side, per_unit: 1.0 / side }
    }

    /// Returns a coordinate in units of a cell's side.
    #[inline(always)]
    pub(super) fn place(self, v: f32) -> f64 {
        f64::from(v) * self.per_unit
    }

    #[inline]
    pub(super) fn cell(self, p: &Point) -> Cell {
        p.map(|v| {
            let place = self.place(v);
            // The floor, without a function call.
            let towards_zero = place as i64;
            towards_zero - i64::from(place < towards_zero as f64)
        })
    }
}

/// Smallest side of a cell: its inverse is finite.
const SMALLEST: f64 = 1e-300;

/// Number of points whose cells one thread numbers at a time.
const NUMBERS_AT_A_TIME: usize = 1 << 17;

/// Packs cells into single numbers of the same order, if those of the whole cloud fit.
pub(super) struct Packing {
    low: Cell,
    /// Number of cells along each axis.
    size: [u64; 3],
    bits: [u32; 3],
}

impl Packing {
    /// Creates the packing of a cloud between two corners; `None` without points, or if its cells do not fit.
    pub(super) fn of((low, high): &(Point, Point), leaf: Leaf) -> Option<Packing> {
        let corners = Some((low, high)).filter(|(low, high)| low[0] <= high[0]);
        let (low, high) = corners.map(|(low, high)| (leaf.cell(low), leaf.cell(high)))?;
        let last: [u64; 3] = std::array::from_fn(|k| high[k].abs_diff(low[k]));
        let (size, bits) = (last.map(|last| last.saturating_add(1)), last.map(|last| u64::BITS - last.leading_zeros()));
        (bits.iter().sum::<u32>() <= u64::BITS).then_some(Packing { low, size, bits })
    }

    /// Returns the number of cells in the cloud's box, if that does not exceed the limit.
    pub(super) fn few_cells(&self, limit: usize) -> Option<usize> {
        let n = self.size.iter().try_fold(1usize, |n, &size| n.checked_mul(usize::try_from(size).ok()?))?;
        (n <= limit && n <= 1 << 31).then_some(n)
    }

    /// Returns the numbers, among the cells of the box, of the cells of all points; requires that the box has few
    /// cells.
    pub(super) fn numbers(&self, points: &[Point], leaf: Leaf) -> Vec<u32> {
        let mut numbers = vec![0; points.len()];
        let steps = [self.size[1] * self.size[2], self.size[2], 1].map(|step| step as u32);
        let low = self.low.map(|low| low as f64);
        let blocks = numbers.par_chunks_mut(NUMBERS_AT_A_TIME).zip(points.par_chunks(NUMBERS_AT_A_TIME));
        blocks.for_each(|(numbers, points)| number_cells(points, leaf, low, steps, numbers));
        numbers
    }

    #[inline]
    pub(super) fn key(&self, cell: &Cell) -> u64 {
        // A shift by 64 occurs only with a cell that is zero.
        (0..3).fold(0, |key: u64, axis| {
            key.checked_shl(self.bits[axis]).unwrap_or(0) | cell[axis].abs_diff(self.low[axis])
        })
    }
}

/// Numbers the cells in a box of at most 2³¹ cells; `steps` are the increments of the numbers along each axis.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn number_cells(points: &[Point], leaf: Leaf, low: [f64; 3], steps: [u32; 3], numbers: &mut [u32]) {
    for (number, point) in numbers.iter_mut().zip(points) {
        // Below 2⁵³, so the difference is exact.
        let [x, y, z]: [u32; 3] = std::array::from_fn(|axis| whole(leaf.place(point[axis]).floor() - low[axis]) as u32);
        *number = x * steps[0] + y * steps[1] + z;
    }
}

/// Added to a smaller whole number, leaves that number in the last bits.
const BEYOND: f64 = (1u64 << 52) as f64;

/// Converts a whole number from 0 to below 2⁵² to an integer; unlike a cast, this is vectorised.
#[inline(always)]
pub(super) fn whole(number: f64) -> u64 {
    (number + BEYOND).to_bits() - BEYOND.to_bits()
}
