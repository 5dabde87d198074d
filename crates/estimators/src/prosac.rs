//! Which triple a trial draws: any triple, or the best ranked ones first.
//!
//! PROSAC (Chum and Matas 2005) draws from a pool of the best ranked correspondences that grows at such a pace that the
//! first `T_N` samples, taken together, are those of uniform drawing, only in a better order.

use crate::draws::{three_of, two_of};
use congruent_geometry::random::Stream;
use serde::{Deserialize, Serialize};

/// The order in which triples are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// All triples always have the same chance.
    #[default]
    Uniform,
    /// Triples of the best ranked correspondences come first.
    Prosac,
}

/// Number of samples after which the order no longer makes a difference (`T_N`); the value of the paper.
const WHOLE: u64 = 200_000;
/// Number of correspondences in a sample.
const SAMPLE: u32 = 3;

/// Draws triples.
pub(crate) enum Triples {
    Uniform { n: u32 },
    Prosac { n: u32, growth: Growth },
}

impl Triples {
    /// Prepares drawing from `n` correspondences, at least three.
    pub(crate) fn new(n: u32, order: Order) -> Self {
        match order {
            Order::Uniform => Triples::Uniform { n },
            Order::Prosac => Triples::Prosac { n, growth: Growth::new(n, WHOLE) },
        }
    }

    /// Draws three different correspondences for one trial.
    pub(crate) fn draw(&self, trial: u64, stream: &mut Stream) -> [u32; 3] {
        match self {
            Triples::Uniform { n } => three_of(*n, stream),
            Triples::Prosac { n, growth } => match growth.pool(trial) {
                // The newest of the pool and two that were there before.
                Some(pool) => {
                    let [a, b] = two_of(pool - 1, stream);
                    [a, b, pool - 1]
                }
                None => three_of(*n, stream),
            },
        }
    }
}

/// The growth of the pool.
pub(crate) struct Growth {
    /// `T'` of the paper: the number of samples drawn before the pool outgrows three, four, ... correspondences.
    until: Vec<u64>,
}

impl Growth {
    fn new(n: u32, whole: u64) -> Self {
        // T_m = T_N Π (m − i) / (N − i), then T_{n+1} = T_n (n + 1) / (n + 1 − m).
        let mut expected =
            (0..SAMPLE).fold(whole as f64, |t, i| t * f64::from(SAMPLE - i) / f64::from(n.saturating_sub(i).max(1)));
        let mut until = vec![1];
        for pool in SAMPLE + 1..=n {
            let next = expected * f64::from(pool) / f64::from(pool - SAMPLE);
            // Slightly reduced, so that rounding does not add a whole sample.
            let more = (next - expected - 1e-9 * next).ceil();
            until.push(until[until.len() - 1] + more as u64);
            expected = next;
        }
        Growth { until }
    }

    /// Returns the number of correspondences from which the trial draws; `None` once all have had their turn.
    fn pool(&self, trial: u64) -> Option<u32> {
        let outgrown = self.until.partition_point(|&until| until <= trial);
        (outgrown < self.until.len()).then_some(outgrown as u32 + SAMPLE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pool_grows_as_computed_by_hand() {
        // 20 triples of 6: T = 1, 4, 10, 20.
        assert_eq!(Growth::new(6, 20).until, [1, 4, 10, 20]);
        // T = 2.5, 10: one sample of the first three, then ⌈7.5⌉ with the fourth.
        assert_eq!(Growth::new(4, 10).until, [1, 9]);
        // T = 0.1 · 1, 4, 10: each step takes at least one sample.
        assert_eq!(Growth::new(5, 1).until, [1, 2, 3]);
        assert_eq!(Growth::new(3, 7).until, [1]);
        let growth = Growth::new(6, 20);
        let pools: Vec<_> = [0, 1, 3, 4, 9, 10, 19, 20].map(|trial| growth.pool(trial)).into();
        assert_eq!(pools, [Some(3), Some(4), Some(4), Some(5), Some(5), Some(6), Some(6), None]);
    }

    #[test]
    fn a_trial_takes_the_newest_of_its_pool() {
        let triples = Triples::new(300, Order::Prosac);
        let Triples::Prosac { growth, .. } = &triples else { unreachable!("the order was asked for") };
        for trial in 0..2000 {
            let [a, b, c] = triples.draw(trial, &mut Stream::new(1, trial));
            assert!(a != b && a < c && b < c && c + 1 == growth.pool(trial).unwrap());
        }
        // C(51, 3) / C(300, 3) of 200 000 is 935, C(52, 3) / C(300, 3) is 992 and C(53, 3) / C(300, 3) is 1052; each of
        // the 50 steps is rounded up, which accounts for a few pool members.
        assert!((45..=53).contains(&growth.pool(999).unwrap()), "{:?}", growth.pool(999));
    }

    #[test]
    fn in_the_end_the_order_makes_no_difference() {
        let growth = Growth::new(6, 20_000);
        let end = growth.until[3];
        let prosac = Triples::Prosac { n: 6, growth };
        let mut counts = std::collections::BTreeMap::new();
        for trial in 0..end {
            let mut triple = prosac.draw(trial, &mut Stream::new(2, trial));
            triple.sort_unstable();
            *counts.entry(triple).or_insert(0u32) += 1;
        }
        // The first three are drawn once, by definition; of the 19 other triples 1000 each are expected, with a
        // standard deviation of at most 31.
        assert_eq!(counts.remove(&[0, 1, 2]), Some(1));
        assert!(counts.len() == 19 && counts.values().all(|&c| c.abs_diff(1000) < 160), "{counts:?}");
        for trial in end..end + 100 {
            let uniform = Triples::new(6, Order::Uniform).draw(trial, &mut Stream::new(2, trial));
            assert_eq!(prosac.draw(trial, &mut Stream::new(2, trial)), uniform);
        }
    }
}
