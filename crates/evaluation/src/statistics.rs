//! Statistics: intervals and tests for counts of successes, medians and quantiles.

/// The 97.5 % point of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Returns the 95 % interval of a success rate (Wilson, 1927): unlike the usual one it stays within 0 and 1 and holds
/// for few trials. The whole range from 0 to 1 for no trials.
#[must_use]
pub fn wilson(successes: usize, trials: usize) -> (f64, f64) {
    if trials == 0 {
        return (0.0, 1.0);
    }
    let (n, rate) = (trials as f64, successes as f64 / trials as f64);
    let scale = 1.0 + Z * Z / n;
    let centre = (rate + Z * Z / (2.0 * n)) / scale;
    let half = Z / scale * (rate * (1.0 - rate) / n + Z * Z / (4.0 * n * n)).sqrt();
    // At the ends the formula is exact, but its rounding is not.
    let low = if successes == 0 { 0.0 } else { centre - half };
    let high = if successes == trials { 1.0 } else { centre + half };
    (low, high)
}

/// Performs McNemar's exact test, two-sided: returns the probability that two equally good methods differ at least this
/// much. `only_first` pairs were solved only by the first method, `only_second` only by the second. One if the methods
/// never differ.
#[must_use]
pub fn mcnemar(only_first: usize, only_second: usize) -> f64 {
    let n = only_first + only_second;
    // In logarithms, because 2⁻ⁿ underflows beyond a thousand pairs.
    let mut ln_term = -(n as f64) * std::f64::consts::LN_2;
    let mut tail = ln_term.exp();
    for k in 0..only_first.min(only_second) {
        ln_term += ((n - k) as f64 / (k + 1) as f64).ln();
        tail += ln_term.exp();
    }
    (2.0 * tail).min(1.0)
}

/// Formats a probability.
#[must_use]
pub fn p_text(p: f64) -> String {
    if p < 1e-4 { "<0.0001".to_owned() } else { format!("{p:.4}") }
}

/// Returns the middle value, or the mean of the two middle ones; `None` for no values.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[middle]),
        _ => Some(f64::midpoint(sorted[middle - 1], sorted[middle])),
    }
}

/// Returns the smallest value that at least the fraction `share` of the values do not exceed; `None` for no values.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 5e-5
    }

    #[test]
    fn wilson_gives_the_textbook_intervals() {
        for (successes, trials, low, high) in [
            (0, 10, 0.0, 0.2775),
            (10, 10, 0.7225, 1.0),
            (5, 10, 0.2366, 0.7634),
            (1, 1, 0.2065, 1.0),
            // The paper's largest set: about four points to each side.
            (248, 496, 0.4562, 0.5438),
        ] {
            let interval = wilson(successes, trials);
            assert!(close(interval.0, low) && close(interval.1, high), "{successes}/{trials}: {interval:?}");
        }
        assert_eq!(wilson(0, 0), (0.0, 1.0));
    }

    #[test]
    fn mcnemar_is_the_two_sided_binomial_test() {
        for (first, second, p) in [
            (0, 0, 1.0),
            (1, 0, 1.0),
            (3, 3, 1.0),
            // 2 · (1 + 6) / 2⁶
            (5, 1, 0.21875),
            // 2 / 2⁸
            (0, 8, 0.007_812_5),
            // 2 · (1 + 12 + 66) / 2¹²
            (2, 10, 0.038_574_218_75),
        ] {
            assert!((mcnemar(first, second) - p).abs() < 1e-12, "{first} {second}: {}", mcnemar(first, second));
        }
        let many = mcnemar(1400, 1600);
        assert!(many > 1e-4 && many < 1e-3, "{many}");
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!((median(&[]), quantile(&[], 0.5)), (None, None));
        let twenty: Vec<f64> = (1..=20).rev().map(f64::from).collect();
        assert_eq!([0.0, 0.5, 0.95, 1.0].map(|share| quantile(&twenty, share)), [1.0, 10.0, 19.0, 20.0].map(Some));
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
