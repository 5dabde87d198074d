//! The results of all pairs, counted.

use super::{Axis, Cell, Measured, Plan, Shows};
use crate::InlierShare;
use crate::statistics::wilson;
use congruent_io::csv_line;
use std::collections::HashMap;

/// All results of an experiment, one column for each cell of each data set.
#[derive(Default)]
pub struct Tally {
    pub(super) columns: Vec<Column>,
    places: HashMap<String, usize>,
    /// Names and numbers of pairs, in the order of their first pair.
    pub(super) datasets: Vec<(String, usize)>,
}

/// One cell of a data set.
pub(super) struct Column {
    pub(super) dataset: String,
    pub(super) cell: Cell,
    /// The result of each pair.
    pub(super) results: Vec<Measured>,
}

impl Column {
    fn change(&self) -> String {
        format!("{}, {}", self.cell.variant, self.cell.nuisance)
    }

    fn is_of_the_same_matches(&self, other: &Column) -> bool {
        self.dataset == other.dataset && self.change() == other.change()
    }
}

/// The result of all pairs of a data set in one cell, at one bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Count {
    /// Name of the data set.
    pub dataset: String,
    /// The cell.
    pub cell: Cell,
    /// Bound below which a pose is right, `pr` of the points on which errors are measured.
    pub d_rmse: f64,
    /// Number of pairs below it.
    pub right: usize,
    /// Number of all pairs.
    pub total: usize,
    /// Mean time for one pose, microseconds; `None` if it was not measured.
    pub microseconds: Option<f64>,
}

impl Count {
    /// Returns the percentage of right poses; zero for no pairs.
    #[must_use]
    pub fn percent(&self) -> f64 {
        100.0 * self.right as f64 / self.total.max(1) as f64
    }

    /// Returns the value on an axis, as tables show it.
    #[must_use]
    pub fn value(&self, axis: Axis) -> String {
        match axis {
            Axis::Dataset => self.dataset.clone(),
            Axis::Variant => self.cell.variant.clone(),
            Axis::Nuisance => self.cell.nuisance.clone(),
            Axis::Estimator => self.cell.estimator.to_string(),
            Axis::Iterations => self.cell.iterations.to_string(),
            Axis::Metric => self.cell.metric.to_string(),
            Axis::Threshold => self.cell.threshold_pr.to_string(),
            Axis::DRmse => self.d_rmse.to_string(),
        }
    }
}

impl Tally {
    /// Adds the results of one pair of a data set: every cell once.
    pub fn add(&mut self, dataset: &str, measured: Vec<Measured>) {
        match self.datasets.iter_mut().find(|(name, _)| name == dataset) {
            Some((_, pairs)) => *pairs += 1,
            None => self.datasets.push((dataset.to_owned(), 1)),
        }
        for one in measured {
            let key = format!("{dataset}\n{:?}", one.cell);
            let place = *self.places.entry(key).or_insert_with(|| {
                let (dataset, cell) = (dataset.to_owned(), one.cell.clone());
                self.columns.push(Column { dataset, cell, results: Vec::new() });
                self.columns.len() - 1
            });
            self.columns[place].results.push(one);
        }
    }

    /// Returns the number of pairs in all data sets.
    #[must_use]
    pub fn pairs(&self) -> usize {
        self.datasets.iter().map(|(_, pairs)| pairs).sum()
    }

    /// Returns the inlier counts of all pairs, for each data set and each change to it; the change is part of the name
    /// if there are several.
    #[must_use]
    pub fn shares(&self) -> Vec<(String, Vec<InlierShare>)> {
        let mut shares: Vec<(&Column, Vec<InlierShare>)> = Vec::new();
        for column in &self.columns {
            if !shares.iter().any(|(known, _)| known.is_of_the_same_matches(column)) {
                shares.push((column, column.results.iter().map(|m| m.share).collect()));
            }
        }
        let changed = shares.iter().any(|(column, _)| column.change() != shares[0].0.change());
        let name = |column: &Column| match changed {
            true => format!("{}, {}", column.dataset, column.change()),
            false => column.dataset.clone(),
        };
        shares.into_iter().map(|(column, shares)| (name(column), shares)).collect()
    }

    /// Returns the count of every cell at every bound of the plan.
    #[must_use]
    pub fn counts(&self, plan: &Plan) -> Vec<Count> {
        let of = |column: &Column, d_rmse: f64| Count {
            dataset: column.dataset.clone(),
            cell: column.cell.clone(),
            d_rmse,
            right: column.results.iter().filter(|m| is_right(m, d_rmse)).count(),
            total: column.results.len(),
            microseconds: mean(column.results.iter().filter_map(|m| m.microseconds)),
        };
        self.columns.iter().flat_map(|column| plan.d_rmse.iter().map(move |&d_rmse| of(column, d_rmse))).collect()
    }

    /// Returns the results as CSV: one line for each cell and bound, or for each bin if the experiment is on inliers.
    #[must_use]
    pub fn csv(&self, plan: &Plan) -> String {
        match plan.shows {
            Shows::Accuracy => self.accuracy_csv(plan),
            Shows::Inliers => self.histogram_csv(),
            Shows::Time => self.time_csv(plan),
        }
    }

    fn accuracy_csv(&self, plan: &Plan) -> String {
        let names = ["dataset", "variant", "nuisance", "estimator", "iterations", "metric", "threshold_pr", "d_rmse"];
        let mut text = csv_line(names.into_iter().chain(["right", "pairs", "accuracy", "low", "high"])) + "\n";
        for count in self.counts(plan) {
            let (low, high) = wilson(count.right, count.total);
            let numbers = [count.percent() / 100.0, low, high].map(|v| format!("{v:.4}"));
            let counts = [count.right.to_string(), count.total.to_string()];
            let values = Axis::ALL.map(|axis| count.value(axis));
            text += &csv_line(values.iter().chain(&counts).chain(&numbers));
            text.push('\n');
        }
        text
    }

    fn time_csv(&self, plan: &Plan) -> String {
        let names = ["dataset", "variant", "nuisance", "estimator", "metric", "threshold_pr", "pairs", "microseconds"];
        // Counts that differ in an axis without a column have the same time.
        let mut lines = vec![csv_line(names)];
        for count in self.counts(plan) {
            let axes = [Axis::Dataset, Axis::Variant, Axis::Nuisance, Axis::Estimator, Axis::Metric, Axis::Threshold];
            let time = count.microseconds.map_or(String::new(), |v| format!("{v:.4}"));
            let line = csv_line(axes.map(|axis| count.value(axis)).into_iter().chain([count.total.to_string(), time]));
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
        lines.join("\n") + "\n"
    }
}

pub(super) fn is_right(measured: &Measured, d_rmse: f64) -> bool {
    measured.rmse_pr.is_some_and(|rmse| rmse < d_rmse)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::experiment::MeasuredOn;

    pub(crate) fn plan() -> Plan {
        Plan {
            title: "Table".to_owned(),
            notes: vec!["a gap, settled".to_owned()],
            shows: Shows::Accuracy,
            rows: Axis::Metric,
            columns: Axis::DRmse,
            variants: vec![],
            nuisances: vec![],
            estimators: vec![],
            metrics: vec![],
            thresholds_pr: vec![7.5],
            iterations: vec![1000],
            d_rmse: vec![1.0, 2.5],
            measured_on: MeasuredOn::Scans,
            baseline: Some("INLIER".to_owned()),
        }
    }

    pub(crate) fn cell(estimator: &'static str, metric: &'static str) -> Cell {
        Cell {
            variant: "v".to_owned(),
            nuisance: "none".to_owned(),
            estimator: estimator.into(),
            iterations: 1000,
            metric: metric.into(),
            threshold_pr: 7.5,
        }
    }

    pub(crate) fn measured(estimator: &'static str, metric: &'static str, rmse_pr: f64) -> Measured {
        let share = InlierShare { inliers: 1, matches: 4 };
        Measured { cell: cell(estimator, metric), rmse_pr: Some(rmse_pr), share, microseconds: None }
    }

    pub(crate) fn tally() -> Tally {
        let mut tally = Tally::default();
        for (mse, inlier) in [(0.5, 2.0), (0.6, 3.0), (2.0, 9.0), (7.0, 2.0)] {
            let of = |estimator| [measured(estimator, "MSE", mse), measured(estimator, "INLIER", inlier)];
            tally.add("set", [of("RANSAC"), of("2SAC-GC")].concat());
        }
        tally
    }

    #[test]
    fn right_poses_are_counted_for_each_cell_and_bound() {
        let csv = tally().csv(&plan());
        assert_eq!(csv.lines().count(), 1 + 2 * 2 * 2);
        assert!(csv.contains("set,v,none,RANSAC,1000,MSE,7.5,1,2,4,0.5000,0.1500,0.8500\n"), "{csv}");
        assert!(csv.contains("set,v,none,RANSAC,1000,MSE,7.5,2.5,3,4,0.7500,"), "{csv}");
        assert!(csv.contains("set,v,none,RANSAC,1000,INLIER,7.5,2.5,2,4,0.5000,"), "{csv}");
    }

    #[test]
    fn data_sets_are_counted_apart() {
        let mut tally = tally();
        tally.add("other", vec![measured("RANSAC", "MSE", 9.0)]);
        assert_eq!((tally.pairs(), tally.datasets.len()), (5, 2));
        let counts = tally.counts(&plan());
        let last = counts.last().unwrap();
        assert_eq!((last.dataset.as_str(), last.right, last.total), ("other", 0, 1));
        assert_eq!(counts.len(), 4 * 2 + 2);
    }

    #[test]
    fn matches_of_a_data_set_are_told_once_and_by_what_changed() {
        let mut tally = tally();
        tally.add("other", vec![measured("RANSAC", "MSE", 9.0)]);
        let told = tally.shares();
        assert_eq!(
            told.iter().map(|(name, s)| (name.as_str(), s.len())).collect::<Vec<_>>(),
            [("set", 4), ("other", 1)]
        );
        let noisy = measured("RANSAC", "MSE", 9.0);
        let cell = Cell { nuisance: "noise".to_owned(), ..noisy.cell.clone() };
        tally.add("other", vec![Measured { cell, ..noisy }]);
        assert_eq!(tally.shares()[2].0, "other, v, noise");
    }

    #[test]
    fn times_are_averaged() {
        let mut tally = Tally::default();
        for time in [2.0, 4.0] {
            tally.add("set", vec![Measured { microseconds: Some(time), ..measured("RANSAC", "MSE", 1.0) }]);
        }
        let plan = Plan { shows: Shows::Time, d_rmse: vec![2.5], ..plan() };
        assert!(tally.csv(&plan).ends_with("set,v,none,RANSAC,MSE,7.5,2,3.0000\n"), "{}", tally.csv(&plan));
    }
}
