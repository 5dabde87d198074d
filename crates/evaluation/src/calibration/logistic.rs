//! Logistic regression by Newton's method, with a small ridge so that separable data have a solution.

use congruent_pipeline::{Calibration, N_TERMS, Predictors};
use nalgebra::{SMatrix, SVector};

const N: usize = N_TERMS + 1;
const ROUNDS: usize = 60;
/// A step shorter than this ends the iteration.
const TOLERANCE: f64 = 1e-10;
/// Terms with a smaller standard deviation are treated as constant.
const MIN_SPREAD: f64 = 1e-9;

/// Returns the calibration under which these answers, right or not, are most probable, given that its weights are
/// normally distributed with variance `1 / ridge` in units of each term's standard deviation. Without answers all
/// weights are zero.
#[must_use]
pub fn fit(answers: impl IntoIterator<Item = (Predictors, bool)>, ridge: f64) -> Calibration {
    let examples: Vec<([f64; N_TERMS], bool)> =
        answers.into_iter().map(|(known, right)| (known.terms(), right)).collect();
    let (mean, spread) = moments(&examples);
    let standard: Vec<(SVector<f64, N>, f64)> = examples
        .iter()
        .map(|(terms, right)| {
            let x = SVector::from_fn(|i, _| if i == 0 { 1.0 } else { (terms[i - 1] - mean[i - 1]) / spread[i - 1] });
            (x, f64::from(u8::from(*right)))
        })
        .collect();
    let solution = newton(&standard, ridge);
    let weights: [f64; N_TERMS] = std::array::from_fn(|i| solution[i + 1] / spread[i]);
    let intercept = solution[0] - weights.iter().zip(mean).map(|(w, m)| w * m).sum::<f64>();
    Calibration::new(intercept, weights)
}

/// Returns the mean and the standard deviation of each term.
fn moments(examples: &[([f64; N_TERMS], bool)]) -> ([f64; N_TERMS], [f64; N_TERMS]) {
    let n = examples.len().max(1) as f64;
    let mean = std::array::from_fn(|i| examples.iter().map(|(x, _)| x[i]).sum::<f64>() / n);
    let spread = std::array::from_fn(|i| {
        let variance: f64 = examples.iter().map(|(x, _)| (x[i] - mean[i]).powi(2)).sum::<f64>() / n;
        if variance.sqrt() > MIN_SPREAD { variance.sqrt() } else { 1.0 }
    });
    (mean, spread)
}

fn newton(examples: &[(SVector<f64, N>, f64)], ridge: f64) -> SVector<f64, N> {
    let mut penalty = SMatrix::<f64, N, N>::identity() * ridge;
    // The intercept is hardly penalised: it reflects the fraction of right answers.
    penalty[(0, 0)] = 1e-6 + ridge * 1e-3;
    let mut weights = SVector::<f64, N>::zeros();
    for _ in 0..ROUNDS {
        let mut gradient = -penalty * weights;
        let mut curvature = penalty;
        for (x, y) in examples {
            let p = 1.0 / (1.0 + (-weights.dot(x)).exp());
            gradient += x * (y - p);
            curvature += x * x.transpose() * (p * (1.0 - p));
        }
        let Some(step) = curvature.cholesky().map(|factor| factor.solve(&gradient)) else { break };
        // Far from the optimum a whole step may overshoot, so its length is limited.
        weights += step * (3.0 / step.norm()).min(1.0);
        if step.norm() < TOLERANCE {
            break;
        }
    }
    weights
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{AttemptRow, CalibrationRow};
    use super::*;
    use crate::calibration::Origin;
    use congruent_geometry::random::Stream;

    /// Rows of one attempt whose answers are right with the probability that a calibration gives.
    pub(crate) fn rows_of(truth: &Calibration, n: u64) -> Vec<CalibrationRow> {
        (0..n)
            .map(|i| {
                let mut stream = Stream::new(7, i);
                let known = Predictors {
                    score: stream.between(0.005, 0.12),
                    overlap: 0.5,
                    residual_pr: stream.between(0.05, 1.5),
                    contradictions: stream.between(0.0, 0.1),
                    disagreeing: stream.between(0.0, 0.05),
                    runner_up: stream.unit(),
                    log10_false_alarms: stream.between(-12.0, 4.0),
                    stiffness: stream.between(0.005, 0.1),
                    normal_angle: stream.between(0.05, 0.4),
                    chosen_from: 1,
                    flatness: 0.0,
                };
                let right = stream.unit() < truth.confidence(&known);
                let error_pr = right.then_some(1.0);
                CalibrationRow {
                    id: format!("{i}"),
                    groups: vec![format!("{}", i / 3)],
                    origin: Origin::Listed,
                    attempts: vec![AttemptRow { error_pr, is_held: true, known, close: Vec::new() }],
                }
            })
            .collect()
    }

    fn answers(rows: &[CalibrationRow]) -> Vec<(Predictors, bool)> {
        rows.iter().map(|row| (row.attempts[0].known, row.attempts[0].error_pr.is_some())).collect()
    }

    #[test]
    fn the_probabilities_that_made_the_data_come_back() {
        let truth = Calibration::new(4.0, [-1.2, -3.0, -30.0, -15.0, 0.5, 0.8, 1.5]);
        let rows = rows_of(&truth, 20_000);
        let found = fit(answers(&rows), 1e-3);
        // Coefficients of correlated terms may compensate for each other.
        for (known, _) in answers(&rows) {
            let (found, expected) = (found.confidence(&known), truth.confidence(&known));
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
        for (found, expected) in found.weights().into_iter().zip(truth.weights()).take(4).filter(|(_, w)| w.abs() > 1.0)
        {
            assert!((found - expected).abs() < 0.12 * expected.abs() + 0.05, "{found} {expected}");
        }
    }

    #[test]
    fn separable_and_empty_data_have_an_answer() {
        let truth = Calibration::new(400.0, [-120.0, -300.0, -800.0, -1500.0, 0.0, 0.0, 0.0]);
        let found = fit(answers(&rows_of(&truth, 300)), 0.1);
        assert!(found.weights().iter().all(|w| w.is_finite()));
        let none = fit([], 0.1);
        assert!(none.weights() == [0.0; N_TERMS] && none.intercept == 0.0);
    }
}
