//! How good a calibration is: cross-validated figures.

use super::{Answer, CalibrationRow, Origin, calibrated};
use congruent_pipeline::{Calibration, DenseVerdictConfig};
use std::collections::BTreeMap;
use std::fmt;

/// Number of parts to which the groups are assigned; each part is judged by a model fitted to the others.
const FOLDS: usize = 5;
/// Ridges from which the one is chosen under which the outcomes of unseen rows are most probable.
const RIDGES: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0];
/// Probabilities are limited to at least this distance from zero and one.
const NEARLY_CERTAIN: f64 = 1e-6;
/// Number of bins of the reliability table.
const BINS: usize = 10;

/// A calibration, and its results on pairs that it has not seen.
pub struct Validation<'a> {
    rows: &'a [CalibrationRow],
    /// The answer for each row, by a model that was not fitted to any row of its first group.
    unseen: Vec<Answer>,
    /// The calibration fitted to all rows.
    pub calibration: Calibration,
    /// The ridge: the variance of the weights is one over this.
    pub ridge: f64,
}

impl<'a> Validation<'a> {
    /// Fits a calibration to all rows, and one without each of five parts for the figures. `verdict` determines what is
    /// accepted; its own calibration is not used.
    #[must_use]
    pub fn new(rows: &'a [CalibrationRow], verdict: &'a DenseVerdictConfig) -> Self {
        let folds = folds(rows);
        let candidates = RIDGES.map(|ridge| (ridge, unseen(rows, &folds, verdict, ridge)));
        let (ridge, unseen) = candidates
            .into_iter()
            .min_by(|(_, a), (_, b)| surprise(rows, a).total_cmp(&surprise(rows, b)))
            .expect("there are ridges to choose from");
        Validation { rows, unseen, calibration: calibrated(rows, verdict, ridge), ridge }
    }

    /// Returns the number of pairs to which the coefficients are fitted.
    #[must_use]
    pub fn learnt_from(&self) -> usize {
        self.rows.iter().filter(|row| row.teaches()).count()
    }

    /// Returns the area under the ROC curve: how often a right answer has more confidence than a wrong one, ties
    /// counting half; zero if there are no right or no wrong answers. Only rows that models are fitted to count.
    #[must_use]
    pub fn auc(&self) -> f64 {
        let of = |right: bool| -> Vec<f64> {
            self.taught().filter(|answer| answer.is_right() == right).map(|answer| answer.confidence).collect()
        };
        let (right, wrong) = (of(true), of(false));
        let wins: f64 = right
            .iter()
            .flat_map(|r| {
                wrong.iter().map(move |w| {
                    if r > w {
                        1.0
                    } else if r < w {
                        0.0
                    } else {
                        0.5
                    }
                })
            })
            .sum();
        wins / (right.len() * wrong.len()).max(1) as f64
    }

    /// Returns the number of right answers among those called `ok`, the number called `ok`, and the number of right
    /// answers; without `Open` rows.
    #[must_use]
    pub fn believed(&self) -> (usize, usize, usize) {
        let closed = || self.all().filter(|(row, _)| row.origin != Origin::Open).map(|(_, answer)| answer);
        let said = || closed().filter(|answer| answer.is_ok);
        let right_said = said().filter(|answer| answer.is_right()).count();
        (right_said, said().count(), closed().filter(|answer| answer.is_right()).count())
    }

    /// Returns for each bin of confidence, ascending, the number of rows, the mean confidence and the fraction of right
    /// answers (zeros for an empty bin). Only rows that models are fitted to count.
    #[must_use]
    pub fn reliability(&self) -> Vec<(usize, f64, f64)> {
        let mut bins = vec![(0usize, 0.0, 0.0); BINS];
        for answer in self.taught() {
            let p = answer.confidence;
            let bin = &mut bins[((p * BINS as f64) as usize).min(BINS - 1)];
            bin.0 += 1;
            bin.1 += p;
            bin.2 += f64::from(u8::from(answer.is_right()));
        }
        bins.into_iter().map(|(n, p, right)| (n, p / n.max(1) as f64, right / n.max(1) as f64)).collect()
    }

    fn all(&self) -> impl Iterator<Item = (&'a CalibrationRow, &Answer)> {
        self.rows.iter().zip(&self.unseen)
    }

    fn taught(&self) -> impl Iterator<Item = &Answer> {
        self.all().filter(|(row, _)| row.teaches()).map(|(_, answer)| answer)
    }
}

/// Returns the parts that contain each row's groups, that of its first group first; groups are assigned in turn, in the
/// order of their names.
fn folds(rows: &[CalibrationRow]) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<&str, usize> = rows.iter().flat_map(|row| &row.groups).map(|g| (g.as_str(), 0)).collect();
    groups.values_mut().enumerate().for_each(|(i, fold)| *fold = i % FOLDS);
    rows.iter().map(|row| row.groups.iter().map(|group| groups[group.as_str()]).collect()).collect()
}

/// Returns the answer for each row by a model fitted to rows that have no group in the part of the row's first group.
fn unseen(rows: &[CalibrationRow], folds: &[Vec<usize>], verdict: &DenseVerdictConfig, ridge: f64) -> Vec<Answer> {
    let others = |fold: usize| rows.iter().zip(folds).filter(move |(_, of)| !of.contains(&fold)).map(|(row, _)| row);
    let models: Vec<Calibration> = (0..FOLDS).map(|fold| calibrated(others(fold), verdict, ridge)).collect();
    rows.iter().zip(folds).map(|(row, of)| row.answer(&models[of[0]], verdict)).collect()
}

/// Returns the negative logarithm of the probability of the outcomes.
fn surprise(rows: &[CalibrationRow], answers: &[Answer]) -> f64 {
    let each = rows.iter().zip(answers).filter(|(row, _)| row.teaches()).map(|(_, answer)| {
        let p = answer.confidence.clamp(NEARLY_CERTAIN, 1.0 - NEARLY_CERTAIN);
        -(if answer.is_right() { p } else { 1.0 - p }).ln()
    });
    each.sum()
}

impl fmt::Display for Validation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (right_said, said, right) = self.believed();
        let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
        writeln!(f, "Cross-validated in {FOLDS} parts, ridge {}; right is below 5 pr.\n", self.ridge)?;
        writeln!(f, "AUC of the confidence, right against wrong: {:.4}", self.auc())?;
        writeln!(f, "right among those called ok: {right_said} of {said} ({:.2} %)", percent(right_said, said))?;
        writeln!(f, "called ok among the right ones: {right_said} of {right} ({:.2} %)\n", percent(right_said, right))?;
        writeln!(f, "| pairs | number | right | called ok | of these right |")?;
        writeln!(f, "|---|---|---|---|---|")?;
        let origins: BTreeMap<Origin, ()> = self.rows.iter().map(|row| (row.origin, ())).collect();
        for origin in origins.into_keys() {
            let here = || self.all().filter(|(row, _)| row.origin == origin).map(|(_, answer)| answer);
            let said = || here().filter(|answer| answer.is_ok);
            let right = |answer: &&Answer| answer.is_right();
            let (n, n_right, n_said, n_good) =
                (here().count(), here().filter(right).count(), said().count(), said().filter(right).count());
            writeln!(f, "| {origin:?} | {n} | {n_right} | {n_said} | {n_good} |")?;
        }
        writeln!(f, "\n| confidence | pairs | mean confidence | share right |")?;
        writeln!(f, "|---|---|---|---|")?;
        for (bin, (n, p, right)) in self.reliability().into_iter().enumerate() {
            let (low, high) = (bin as f64 / BINS as f64, (bin + 1) as f64 / BINS as f64);
            writeln!(f, "| {low:.1} to {high:.1} | {n} | {p:.3} | {right:.3} |")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::logistic::tests::rows_of;
    use super::*;
    use congruent_pipeline::N_TERMS;

    #[test]
    fn a_model_that_fits_is_reliable_and_its_figures_add_up() {
        let truth = Calibration::new(4.0, [-1.2, -3.0, -30.0, -15.0, 0.3, 0.0, 0.0]);
        let rows = rows_of(&truth, 3000);
        let verdict = DenseVerdictConfig::default();
        let validation = Validation::new(&rows, &verdict);
        for (n, p, right) in validation.reliability() {
            // Four standard deviations of a fraction.
            let deviation = (p * (1.0 - p) / n.max(1) as f64).sqrt();
            assert!(n < 100 || (p - right).abs() < 4.0 * deviation, "{n} {p} {right}");
        }
        let (right_said, said, right) = validation.believed();
        assert!(right_said <= said && right_said <= right && said > 0);
        assert_eq!(right, rows.iter().filter(|row| row.attempts[0].error_pr.is_some()).count());
        assert!(validation.auc() > 0.8);
    }

    #[test]
    fn no_group_is_on_both_sides() {
        let rows = rows_of(&Calibration::new(0.0, [0.0; N_TERMS]), 300);
        let folds = folds(&rows);
        for (a, b) in (0..300).flat_map(|a| (0..300).map(move |b| (a, b))) {
            assert!(rows[a].groups != rows[b].groups || folds[a] == folds[b]);
        }
    }

    #[test]
    fn nothing_to_learn_from_gives_an_even_guess() {
        let verdict = DenseVerdictConfig::default();
        let validation = Validation::new(&[], &verdict);
        assert!(validation.believed() == (0, 0, 0) && validation.auc() == 0.0);
        assert!(validation.to_string().contains("0 of 0"));
    }
}
