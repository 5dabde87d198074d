//! When to stop sampling: once a sample consisting only of inliers has very likely been drawn.

use congruent_geometry::RigidTransform;
use congruent_metrics::{Evidence, InlierCount, Metric, Summed};

/// Stops after `k ≥ ln(1 − η) / ln(1 − P)` samples, `P` being the chance that one holds only inliers of the best pose.
#[derive(Clone, Debug)]
pub struct AdaptiveStop {
    confidence: f64,
    sample_size: usize,
    count: Summed<InlierCount>,
}

impl AdaptiveStop {
    /// Creates the rule. `confidence` is η, below one; residuals below `threshold` (data units) are inliers.
    #[must_use]
    pub fn new(confidence: f64, threshold: f64, sample_size: usize) -> Self {
        AdaptiveStop { confidence, sample_size, count: Summed(InlierCount::new(threshold)) }
    }

    /// Returns the number of inliers of a pose.
    pub(crate) fn inliers(&self, evidence: &Evidence, pose: &RigidTransform) -> usize {
        self.count.score(evidence, pose).value() as usize
    }

    /// Returns whether `samples` are enough if the best pose has `inliers` of `n`.
    pub(crate) fn enough(&self, samples: u64, inliers: usize, n: usize) -> bool {
        if inliers < self.sample_size {
            return false;
        }
        let clean: f64 = (0..self.sample_size).map(|j| (inliers - j) as f64 / (n - j) as f64).product();
        // ln(1 − 1) is −∞, so any number of samples is enough.
        samples as f64 >= (-self.confidence).ln_1p() / (-clean).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_needed_are_those_of_the_formula() {
        let stop = AdaptiveStop::new(0.999, 1.0, 3);
        for (inliers, n, needed) in [
            // P = 50·49·48 / (100·99·98) = 0.12121; ln 0.001 / ln 0.87879 = 53.46.
            (50, 100, 54),
            // P = 10·9·8 / (100·99·98) = 0.00074212; −6.90776 / −0.00074240 = 9304.7.
            (10, 100, 9305),
            (100, 100, 0),
        ] {
            assert!(stop.enough(needed, inliers, n), "{inliers}");
            assert!(needed == 0 || !stop.enough(needed - 1, inliers, n), "{inliers}");
        }
        assert!(!stop.enough(u64::MAX, 2, 100) && !stop.enough(u64::MAX, 0, 0));
    }
}
