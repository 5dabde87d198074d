//! The table over many pairs.

use crate::statistics::{mcnemar, median, p_text, quantile, wilson};
use crate::{PairRow, Status};
use congruent_pipeline::Verdict;
use std::collections::HashMap;
use std::fmt::{self, Write};

/// The bounds at which a pose counts as right, in `pr`.
pub const D_RMSE: [f64; 10] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0];
/// The bound at which the verdict is judged, in `pr`.
pub const VERDICT_D_RMSE: f64 = 5.0;
/// Fewer true correspondences than this cannot determine a pose.
const MIN_TRUE_MATCHES: usize = 3;
/// Bands of overlap: lower bound (inclusive), upper bound, name.
pub const BANDS: [(f64, f64, &str); 3] =
    [(0.0, 0.3, "overlap < 0.3"), (0.3, 0.5, "0.3 to 0.5"), (0.5, f64::INFINITY, "0.5 and more")];

/// Accuracy, time and verdicts of many pairs; `Display` formats them.
pub struct Summary<'a> {
    scored: Vec<&'a PairRow>,
    not_evaluable: Vec<&'a PairRow>,
    errors: usize,
}

impl<'a> Summary<'a> {
    /// Summarises these rows.
    #[must_use]
    pub fn new(rows: &'a [PairRow]) -> Self {
        let of = |status| rows.iter().filter(|row| row.status == status).collect::<Vec<_>>();
        Summary { scored: of(Status::Scored), not_evaluable: of(Status::NotEvaluable), errors: of(Status::Error).len() }
    }

    /// Returns the number of scored pairs that are right at the bound, and the number of scored pairs.
    #[must_use]
    pub fn right(&self, d_rmse: f64) -> (usize, usize) {
        right(&self.scored, d_rmse)
    }

    /// Returns the number of right pairs among those called `ok`, and the number called `ok`. Right is below
    /// [`VERDICT_D_RMSE`].
    #[must_use]
    pub fn verdict_precision(&self) -> (usize, usize) {
        let said_ok: Vec<&PairRow> =
            self.scored.iter().copied().filter(|row| row.verdict == Some(Verdict::Ok)).collect();
        right(&said_ok, VERDICT_D_RMSE)
    }

    fn write_accuracy(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bands = BANDS.iter().map(|&(from, below, name)| {
            let inside = |row: &&&PairRow| (from..below).contains(&row.overlap);
            (name, self.scored.iter().filter(inside).copied().collect::<Vec<_>>())
        });
        let columns: Vec<_> = std::iter::once(("all", self.scored.clone())).chain(bands).collect();
        write!(f, "{:>9}", "d_rmse")?;
        for (name, _) in &columns {
            write!(f, "{name:>26}")?;
        }
        writeln!(f)?;
        for d_rmse in D_RMSE {
            write!(f, "{d_rmse:>6.1} pr")?;
            for (_, rows) in &columns {
                let (good, all) = right(rows, d_rmse);
                write!(f, "{:>26}", share(good, all))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} pairs scored, {} not evaluable, {} with errors. Accuracy with 95 % intervals (Wilson):",
            self.scored.len(),
            self.not_evaluable.len(),
            self.errors
        )?;
        self.write_accuracy(f)?;
        let seconds: Vec<f64> = self.scored.iter().map(|row| row.seconds).collect();
        if let Some((median, most)) = median(&seconds).zip(quantile(&seconds, 0.95)) {
            let mean = seconds.iter().sum::<f64>() / seconds.len() as f64;
            writeln!(f, "time per pair: median {median:.2} s, mean {mean:.2} s, 95 % within {most:.2} s")?;
        }
        let (good, said) = self.verdict_precision();
        writeln!(f, "verdict: {said} called ok, {good} of them right at {VERDICT_D_RMSE} pr ({})", share(good, said))?;
        let possible: Vec<&PairRow> =
            self.scored.iter().copied().filter(|row| row.inliers_5pr >= MIN_TRUE_MATCHES).collect();
        let hopeless = self.scored.len() - possible.len();
        if hopeless > 0 {
            let (good, all) = right(&possible, 2.5);
            writeln!(
                f,
                "{hopeless} pairs have fewer than {MIN_TRUE_MATCHES} true matches; they are included above. Without them, \
                 at 2.5 pr: {}",
                share(good, all)
            )?;
        }
        for row in &self.not_evaluable {
            writeln!(f, "not evaluable: {} to {} ({} shared points)", row.source, row.target, row.n_shared)?;
        }
        Ok(())
    }
}

fn right(rows: &[&PairRow], d_rmse: f64) -> (usize, usize) {
    (rows.iter().filter(|row| row.is_right(d_rmse)).count(), rows.len())
}

/// Formats a rate and its interval in percent; a dash for no trials.
fn share(good: usize, all: usize) -> String {
    if all == 0 {
        return "-".to_owned();
    }
    let (low, high) = wilson(good, all);
    let percent = |v: f64| 100.0 * v;
    format!("{:.1} % [{:.1}, {:.1}]", percent(good as f64 / all as f64), percent(low), percent(high))
}

/// Compares two batches on the pairs that are scored in both, at every bound, by McNemar's exact test. Pairs are
/// identified by their fingerprints.
#[must_use]
pub fn mcnemar_of(first: &[PairRow], second: &[PairRow]) -> String {
    let others: HashMap<&str, &PairRow> =
        second.iter().filter(|row| row.status == Status::Scored).map(|row| (row.pair.as_str(), row)).collect();
    let common: Vec<(&PairRow, &PairRow)> = first
        .iter()
        .filter(|row| row.status == Status::Scored)
        .filter_map(|row| Some((row, *others.get(row.pair.as_str())?)))
        .collect();
    let mut text = format!("{} pairs in common. McNemar's exact test, two-sided:\n", common.len());
    let mut line = |line: fmt::Arguments<'_>| writeln!(text, "{line}").expect("a string can be written to");
    line(format_args!(
        "{:>9}{:>10}{:>10}{:>12}{:>12}{:>10}",
        "d_rmse", "this", "other", "this alone", "other alone", "p"
    ));
    for d_rmse in D_RMSE {
        let count = |is: &dyn Fn(bool, bool) -> bool| {
            common.iter().filter(|(a, b)| is(a.is_right(d_rmse), b.is_right(d_rmse))).count()
        };
        let (this_alone, other_alone) = (count(&|a, b| a && !b), count(&|a, b| b && !a));
        let both = count(&|a, b| a && b);
        line(format_args!(
            "{d_rmse:>6.1} pr{:>10}{:>10}{this_alone:>12}{other_alone:>12}{:>10}",
            both + this_alone,
            both + other_alone,
            p_text(mcnemar(this_alone, other_alone))
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pair: &str, overlap: f64, rmse_pr: Option<f64>, verdict: Verdict) -> PairRow {
        PairRow {
            rmse_pr,
            verdict: Some(verdict),
            pair: pair.to_owned(),
            inliers_5pr: 9,
            seconds: 1.0,
            ..PairRow::new("set", "a", "b", overlap)
        }
    }

    fn rows() -> Vec<PairRow> {
        vec![
            row("1", 0.9, Some(0.7), Verdict::Ok),
            row("2", 0.2, Some(7.0), Verdict::Ok),
            row("3", 0.4, Some(2.4), Verdict::Failed),
            row("4", 0.4, None, Verdict::Failed),
            row("5", 0.4, None, Verdict::Failed).with_error("gone".to_owned()),
            PairRow { status: Status::NotEvaluable, ..row("6", 0.0, None, Verdict::Ok) },
        ]
    }

    #[test]
    fn only_scored_pairs_count_and_no_pose_is_wrong() {
        let rows = rows();
        let summary = Summary::new(&rows);
        assert_eq!((summary.right(0.5), summary.right(1.0), summary.right(2.5)), ((0, 4), (1, 4), (2, 4)));
        assert_eq!(summary.verdict_precision(), (1, 2));
        let text = summary.to_string();
        assert!(text.contains("4 pairs scored, 1 not evaluable, 1 with errors"), "{text}");
        assert!(text.contains("   2.5 pr") && text.contains("50.0 % [15.0, 85.0]"), "{text}");
    }

    #[test]
    fn pairs_are_compared_by_what_they_are() {
        let first = rows();
        let mut second = rows();
        second.reverse();
        second.iter_mut().filter(|row| row.pair == "1").for_each(|row| row.rmse_pr = Some(9.0));
        let text = mcnemar_of(&first, &second);
        assert!(text.starts_with("4 pairs in common"), "{text}");
        let at = text.lines().find(|line| line.contains("2.5 pr")).unwrap();
        assert_eq!(at.split_whitespace().collect::<Vec<_>>(), ["2.5", "pr", "2", "1", "1", "0", "1.0000"]);
    }
}
