//! The cells of a sweep, and the result of one for one pair.

use crate::InlierShare;
use congruent_io::csv_line;
use std::borrow::Cow;

/// The position of a result in the sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Name of the variant of the chain.
    pub variant: String,
    /// Name of the nuisance on the target.
    pub nuisance: String,
    /// Name of the estimator; empty if nothing was proposed.
    pub estimator: Cow<'static, str>,
    /// Number of trials of the stream that count; zero if nothing was proposed.
    pub iterations: u64,
    /// Name of the metric; empty if nothing was ranked.
    pub metric: Cow<'static, str>,
    /// Inlier threshold, `pr` of the chain; zero if nothing was ranked.
    pub threshold_pr: f64,
}

/// The result of one cell for one pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The cell.
    pub cell: Cell,
    /// RMSE of the best pose, in `pr` of the points on which errors are measured; `None` if there is no pose or errors
    /// were not measured.
    pub rmse_pr: Option<f64>,
    /// The true correspondences among the matches.
    pub share: InlierShare,
    /// Time for one pose, microseconds, on one thread; `None` if it was not measured.
    pub microseconds: Option<f64>,
}

impl Measured {
    /// Columns of [`Measured::csv`].
    pub const COLUMNS: [&str; 13] = [
        "dataset",
        "source",
        "target",
        "variant",
        "nuisance",
        "estimator",
        "iterations",
        "metric",
        "threshold_pr",
        "rmse_pr",
        "matches",
        "inliers",
        "microseconds",
    ];

    /// Returns one line of CSV, in the order of [`Measured::COLUMNS`]; `pair` is the data set, the source and the
    /// target.
    #[must_use]
    pub fn csv(&self, pair: [&str; 3]) -> String {
        let Measured { cell, rmse_pr, share, microseconds } = self;
        let maybe = |value: &Option<f64>| value.map_or(String::new(), |v| format!("{v:.4}"));
        let numbers = [
            cell.iterations.to_string(),
            cell.metric.to_string(),
            cell.threshold_pr.to_string(),
            maybe(rmse_pr),
            share.matches.to_string(),
            share.inliers.to_string(),
            maybe(microseconds),
        ];
        let names = [cell.variant.as_str(), &cell.nuisance, &cell.estimator];
        csv_line(pair.into_iter().chain(names).chain(numbers.iter().map(String::as_str)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_every_column() {
        let cell = Cell {
            variant: "10 %, best".to_owned(),
            nuisance: "none".to_owned(),
            estimator: "RANSAC".into(),
            iterations: 1000,
            metric: "MSE".into(),
            threshold_pr: 7.5,
        };
        let share = InlierShare { inliers: 3, matches: 12 };
        let measured = Measured { cell, rmse_pr: Some(1.25), share, microseconds: None };
        let line = measured.csv(["set", "a", "b"]);
        assert_eq!(line, "set,a,b,\"10 %, best\",none,RANSAC,1000,MSE,7.5,1.2500,12,3,");
        // One comma is inside quotes.
        assert_eq!(line.matches(',').count() - 1, Measured::COLUMNS.len() - 1);
    }
}
