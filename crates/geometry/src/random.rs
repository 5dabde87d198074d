//! Random streams that do not depend on which thread draws first.
//!
//! Work item *i* draws from its own stream, keyed by `(seed, i)`, so the result is the same on one thread or on many.
//! The generator is a named one and the bounded draw is implemented here, because neither may change with a library's
//! version.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// Creates the stream of one work item.
    #[must_use]
    pub fn new(seed: u64, item: u64) -> Self {
        // An odd multiplier keeps the items of one seed distinct; the generator's own seeding mixes the bits.
        let key = mixed(seed).wrapping_add(item.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        Stream(Xoshiro256PlusPlus::seed_from_u64(key))
    }

    /// Draws a number below `n`, uniformly (Lemire's rejection). `n` must be above zero.
    pub fn below(&mut self, n: u32) -> u32 {
        debug_assert!(n > 0, "nothing can be drawn from an empty range");
        let mut product = u64::from(self.0.next_u32()) * u64::from(n);
        if (product as u32) < n {
            let threshold = n.wrapping_neg() % n;
            while (product as u32) < threshold {
                product = u64::from(self.0.next_u32()) * u64::from(n);
            }
        }
        (product >> 32) as u32
    }

    /// Draws a number in `[0, 1)` with 53 random bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Draws a number in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Draws from the standard normal distribution (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }

    /// Draws a rotation, uniformly over all rotations (Shoemake 1992).
    pub fn rotation(&mut self) -> nalgebra::UnitQuaternion<f64> {
        let q = nalgebra::Quaternion::new(self.normal(), self.normal(), self.normal(), self.normal());
        nalgebra::UnitQuaternion::from_quaternion(q)
    }
}

/// Applies one round of SplitMix64.
fn mixed(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, item| {
            let mut s = Stream::new(seed, item);
            [s.below(1000), s.below(1000), s.below(1000)]
        };
        assert_eq!(draw(7, 3), draw(7, 3));
        assert_ne!(draw(7, 3), draw(7, 4));
        assert_ne!(draw(7, 3), draw(8, 3));
    }

    #[test]
    fn bounded_draws_are_even() {
        let mut counts = [0u32; 5];
        let mut stream = Stream::new(1, 1);
        for _ in 0..50_000 {
            counts[stream.below(5) as usize] += 1;
        }
        // Five standard deviations of a binomial count: 5·sqrt(50000·0.2·0.8) = 447.
        assert!(counts.iter().all(|&c| c.abs_diff(10_000) < 447), "{counts:?}");
    }

    #[test]
    fn normal_draws_have_unit_variance() {
        let mut stream = Stream::new(2, 0);
        let draws: Vec<f64> = (0..20_000).map(|_| stream.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 20_000.0;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.04 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
