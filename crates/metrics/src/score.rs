//! The score that a metric gives to a hypothesis.

use std::cmp::Ordering;

/// A score: larger is always better; never NaN, so that scores have a total order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score(f64);

impl Score {
    /// Below every other score: the score of a pose that is rejected.
    pub const WORST: Score = Score(f64::NEG_INFINITY);

    /// Creates a score; NaN becomes the worst.
    #[must_use]
    pub fn new(value: f64) -> Score {
        // Negative zero becomes positive, so that scores that compare as equal are equal.
        if value.is_nan() { Score::WORST } else { Score(value + 0.0) }
    }

    /// Returns the number.
    #[must_use]
    pub fn value(self) -> f64 {
        self.0
    }
}

impl Eq for Score {}

impl Ord for Score {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Score {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn not_a_number_is_the_worst() {
        assert_eq!(Score::new(f64::NAN), Score::WORST);
        assert!(Score::WORST < Score::new(-1e300) && Score::new(1.0) < Score::new(2.0));
    }
}
