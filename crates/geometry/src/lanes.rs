//! Sums of many numbers, so many of them side by side that whole vector registers are added.
//!
//! The lanes are added in a fixed order, so the bits are the same on every instruction set. All of it becomes part of the
//! loop that calls it, and is compiled for the instructions of that loop.

use std::ops::AddAssign;

/// The sum of rows of numbers.
#[inline(always)]
#[must_use]
pub fn sum<const LANES: usize>(a: &[[f64; LANES]]) -> f64 {
    let mut sums = [0.0; LANES];
    for a in a {
        for lane in 0..LANES {
            sums[lane] += a[lane];
        }
    }
    across(sums)
}

/// The sum of the products of two times as many numbers; of the shorter where there are more of one.
#[inline(always)]
#[must_use]
pub fn dot<const LANES: usize>(a: &[[f64; LANES]], b: &[[f64; LANES]]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    across(sums)
}

/// The sum of one row, whose length is a power of two: half is added to half, until one number is left.
#[inline(always)]
#[must_use]
pub fn across<T: Copy + AddAssign, const LANES: usize>(mut sums: [T; LANES]) -> T {
    const { assert!(LANES.is_power_of_two()) };
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            let other = sums[lane + width];
            sums[lane] += other;
        }
        width /= 2;
    }
    sums[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_counts_once() {
        let rows = [[1.0, 2.0, 4.0, 8.0], [16.0, 32.0, 64.0, 128.0]];
        assert_eq!(sum(&rows), 255.0);
        assert_eq!(sum::<4>(&[]), 0.0);
        assert_eq!(dot(&rows, &[[1.0, 0.0, 0.0, 3.0], [0.0, 5.0, 0.0, 0.0]]), 1.0 + 24.0 + 160.0);
        assert_eq!(across([7u32]), 7);
        assert_eq!(across([1u32, 2, 4, 8, 16, 32, 64, 128]), 255);
    }
}
