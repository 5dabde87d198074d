//! Where in a sweep a result belongs, and what it is.

use crate::InlierShare;
use congruent_io::csv_line;
use std::borrow::Cow;

/// Where in the sweep a result belongs.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Name of the change to the chain.
    pub variant: String,
    /// Name of what the target was spoilt with.
    pub nuisance: String,
    /// Who proposed; empty where nothing was proposed.
    pub estimator: Cow<'static, str>,
    /// How much of the stream was looked at.
    pub iterations: u64,
    /// Who ranked; empty where nothing was ranked.
    pub metric: Cow<'static, str>,
    /// Inlier threshold, `pr` of the chain.
    pub threshold_pr: f64,
}

/// What one cell says of one pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Which.
    pub cell: Cell,
    /// Of the best pose; nothing where there was none.
    pub rmse_pr: Option<f64>,
    /// Of the matches.
    pub share: InlierShare,
    /// Time for one pose, microseconds, on one thread; nothing where that was not asked for.
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

    /// One line of CSV, in the order of [`Measured::COLUMNS`]; `pair` is the data set, the source and the target.
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
        // One comma is quoted.
        assert_eq!(line.matches(',').count() - 1, Measured::COLUMNS.len() - 1);
    }
}
