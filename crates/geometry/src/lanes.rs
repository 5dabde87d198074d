//! Sums of many numbers, in as many lanes side by side as fill whole vector registers.
//!
//! The lanes are added in a fixed order, so the result is bit-identical on every instruction set. All functions are
//! inlined into the loop that calls them and compiled for its instruction set.

use std::ops::AddAssign;

/// Returns the sum of rows of numbers.
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

/// Returns the dot product of two sequences of numbers; if one is longer, its excess is ignored.
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

/// Returns the sum of one row, whose length is a power of two, by adding halves until one number is left.
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
