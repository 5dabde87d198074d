//! Results of all pairs, counted and laid out.

use super::{Axis, Cell, Measured, Plan};
use crate::csv_line;
use crate::statistics::{mcnemar, median, p_text, wilson};
use std::collections::HashMap;
use std::fmt::Write;

/// All that an experiment measured, a column a cell.
#[derive(Default)]
pub struct Tally {
    cells: Vec<Cell>,
    /// For each cell what each pair gave.
    results: Vec<Vec<Measured>>,
    places: HashMap<String, usize>,
    pairs: usize,
}

/// A cell at one bound of a right pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// In the order of [`Axis::ALL`].
    pub values: [String; Axis::ALL.len()],
    /// Pairs whose pose was right.
    pub right: usize,
    /// All pairs.
    pub total: usize,
}

impl Tally {
    /// Adds what one pair gave: every cell once.
    pub fn add(&mut self, measured: Vec<Measured>) {
        self.pairs += 1;
        for one in measured {
            let key = format!("{:?}", one.cell);
            let place = *self.places.entry(key).or_insert_with(|| {
                self.cells.push(one.cell.clone());
                self.results.push(Vec::new());
                self.cells.len() - 1
            });
            self.results[place].push(one);
        }
    }

    /// How many pairs there were.
    #[must_use]
    pub fn pairs(&self) -> usize {
        self.pairs
    }

    /// One line for each cell and bound.
    #[must_use]
    pub fn csv(&self, plan: &Plan) -> String {
        let names = [
            "variant",
            "nuisance",
            "estimator",
            "iterations",
            "metric",
            "threshold_pr",
            "d_rmse",
            "right",
            "pairs",
            "accuracy",
            "low",
            "high",
        ];
        let mut text = names.join(",") + "\n";
        for entry in self.entries(plan) {
            let (low, high) = wilson(entry.right, entry.total);
            let accuracy = entry.right as f64 / entry.total.max(1) as f64;
            let numbers = [accuracy, low, high].map(|v| format!("{v:.4}"));
            let counts = [entry.right.to_string(), entry.total.to_string()];
            text += &csv_line(entry.values.iter().chain(&counts).chain(&numbers));
            text.push('\n');
        }
        text
    }

    /// The title, the notes and the tables.
    #[must_use]
    pub fn markdown(&self, plan: &Plan, dataset: &str) -> String {
        let mut text = format!("# {}\n\n{} pairs of {dataset}.\n", plan.title, self.pairs);
        for note in &plan.notes {
            text += &format!("\n* {note}");
        }
        text += "\n\n## Registration accuracy, %\n";
        let entries = self.entries(plan);
        text += &pivot(plan, &entries, &|entry: &Entry| {
            format!("{:.1}", 100.0 * entry.right as f64 / entry.total.max(1) as f64)
        });
        text += &format!("\n95 % intervals are in the CSV; at half right they are {}.\n", half_width(self.pairs));
        text += &self.inlier_table();
        if plan.timed {
            text += &self.time_table();
        }
        if let Some(baseline) = &plan.baseline {
            text += &self.baseline_table(plan, baseline);
        }
        text
    }

    /// Every cell at every bound, cell by cell.
    #[must_use]
    pub fn entries(&self, plan: &Plan) -> Vec<Entry> {
        let mut entries = Vec::new();
        for (cell, results) in self.cells.iter().zip(&self.results) {
            for &d_rmse in &plan.d_rmse {
                let right = results.iter().filter(|m| is_right(m, d_rmse)).count();
                let values = Axis::ALL.map(|axis| value(cell, axis, d_rmse));
                entries.push(Entry { values, right, total: results.len() });
            }
        }
        entries
    }

    /// Median share of true matches, for each set of matches.
    fn inlier_table(&self) -> String {
        let mut text = "\n## True matches (within 5 pr of the chain)\n\n| matches of | median ratio | median count |\n|---|---:|---:|\n".to_owned();
        let mut seen = Vec::new();
        for (cell, results) in self.cells.iter().zip(&self.results) {
            let name = format!("{}, {}", cell.variant, cell.nuisance);
            if seen.contains(&name) {
                continue;
            }
            let of = |f: &dyn Fn(&Measured) -> f64| median(&results.iter().map(f).collect::<Vec<_>>()).unwrap_or(0.0);
            let (ratio, count) = (of(&|m| m.share.ratio()), of(&|m| m.share.inliers as f64));
            text += &format!("| {name} | {:.1} % | {count:.0} |\n", 100.0 * ratio);
            seen.push(name);
        }
        text
    }

    fn time_table(&self) -> String {
        let mut text =
            "\n## Time for one pose, one thread\n\n| estimator | metric | mean, microseconds |\n|---|---|---:|\n"
                .to_owned();
        for (cell, results) in self.cells.iter().zip(&self.results) {
            let times: Vec<f64> = results.iter().filter_map(|m| m.microseconds).collect();
            let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
            writeln!(text, "| {} | {} | {mean:.2} |", cell.estimator, cell.metric).expect("a string can be written to");
        }
        text
    }

    /// Every metric against the baseline with the same of all else.
    fn baseline_table(&self, plan: &Plan, baseline: &str) -> String {
        let mut text = format!(
            "\n## Against {baseline} (McNemar's exact test, two-sided)\n\n| case | metric | alone right | {baseline} alone right | p |\n|---|---|---:|---:|---:|\n"
        );
        for (cell, results) in self.cells.iter().zip(&self.results).filter(|(cell, _)| cell.metric != baseline) {
            let of_baseline =
                |other: &Cell| *other == Cell { metric: other.metric, ..cell.clone() } && other.metric == baseline;
            let Some(place) = self.cells.iter().position(of_baseline) else { continue };
            for &d_rmse in &plan.d_rmse {
                let both = || results.iter().zip(&self.results[place]);
                let alone = both().filter(|(a, b)| is_right(a, d_rmse) && !is_right(b, d_rmse)).count();
                let other = both().filter(|(a, b)| !is_right(a, d_rmse) && is_right(b, d_rmse)).count();
                let case = self.varying(plan, cell, d_rmse);
                let p = p_text(mcnemar(alone, other));
                text += &format!("| {case} | {} | {alone} | {other} | {p} |\n", cell.metric);
            }
        }
        text
    }

    /// What tells a cell from its neighbours, without the metric.
    fn varying(&self, plan: &Plan, cell: &Cell, d_rmse: f64) -> String {
        let entries = self.entries(plan);
        let varies = |i: &usize| entries.iter().any(|entry| entry.values[*i] != entries[0].values[*i]);
        let places = (0..Axis::ALL.len()).filter(|i| Axis::ALL[*i] != Axis::Metric).filter(varies);
        let parts: Vec<String> =
            places.map(|i| format!("{} {}", Axis::ALL[i].name(), value(cell, Axis::ALL[i], d_rmse))).collect();
        parts.join(", ")
    }
}

fn is_right(measured: &Measured, d_rmse: f64) -> bool {
    measured.rmse_pr.is_some_and(|rmse| rmse < d_rmse)
}

fn value(cell: &Cell, axis: Axis, d_rmse: f64) -> String {
    match axis {
        Axis::Variant => cell.variant.clone(),
        Axis::Nuisance => cell.nuisance.clone(),
        Axis::Estimator => cell.estimator.to_owned(),
        Axis::Iterations => cell.iterations.to_string(),
        Axis::Metric => cell.metric.to_owned(),
        Axis::Threshold => cell.threshold_pr.to_string(),
        Axis::DRmse => d_rmse.to_string(),
    }
}

fn half_width(pairs: usize) -> String {
    let (low, high) = wilson(pairs / 2, pairs);
    format!("{:.0} points to each side", 50.0 * (high - low))
}

/// One table of rows against columns for each combination of all else that varies.
fn pivot(plan: &Plan, entries: &[Entry], shown: &dyn Fn(&Entry) -> String) -> String {
    let place = |axis: Axis| Axis::ALL.iter().position(|a| *a == axis).expect("an axis is among all of them");
    let (row, column) = (place(plan.rows), place(plan.columns));
    let rest = |entry: &Entry| {
        let others = (0..Axis::ALL.len()).filter(|i| *i != row && *i != column);
        let varying = others.filter(|i| entries.iter().any(|e| e.values[*i] != entries[0].values[*i]));
        varying.map(|i| format!("{} {}", Axis::ALL[i].name(), entry.values[i])).collect::<Vec<_>>().join(", ")
    };
    let mut text = String::new();
    for table in distinct(entries.iter().map(&rest)) {
        let inside: Vec<&Entry> = entries.iter().filter(|entry| rest(entry) == table).collect();
        let columns = distinct(inside.iter().map(|entry| entry.values[column].clone()));
        if !table.is_empty() {
            text += &format!("\n### {table}\n");
        }
        let corner = format!("{} \\ {}", plan.rows.name(), plan.columns.name());
        text += &format!("\n| {corner} | {} |\n|---|{}\n", columns.join(" | "), "---:|".repeat(columns.len()));
        for name in distinct(inside.iter().map(|entry| entry.values[row].clone())) {
            let at = |c: &String| inside.iter().find(|e| e.values[row] == name && e.values[column] == *c);
            let line: Vec<String> = columns.iter().map(|c| at(c).map_or("-".to_owned(), |e| shown(e))).collect();
            text += &format!("| {name} | {} |\n", line.join(" | "));
        }
    }
    text
}

/// Each value once, in the order of its first appearance.
fn distinct(values: impl Iterator<Item = String>) -> Vec<String> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InlierShare;
    use crate::experiment::MeasuredOn;

    fn plan() -> Plan {
        Plan {
            title: "Table".to_owned(),
            notes: vec!["a gap, settled".to_owned()],
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
            timed: false,
        }
    }

    fn measured(estimator: &'static str, metric: &'static str, rmse_pr: f64) -> Measured {
        let cell = Cell {
            variant: "v".to_owned(),
            nuisance: "none".to_owned(),
            estimator,
            iterations: 1000,
            metric,
            threshold_pr: 7.5,
        };
        let share = InlierShare { inliers: 1, matches: 4 };
        Measured { cell, rmse_pr: Some(rmse_pr), share, microseconds: None }
    }

    fn tally() -> Tally {
        let mut tally = Tally::default();
        for (mse, inlier) in [(0.5, 2.0), (0.6, 3.0), (2.0, 9.0), (7.0, 2.0)] {
            let of = |estimator| [measured(estimator, "MSE", mse), measured(estimator, "INLIER", inlier)];
            tally.add([of("RANSAC"), of("2SAC-GC")].concat());
        }
        tally
    }

    #[test]
    fn right_poses_are_counted_for_each_cell_and_bound() {
        let csv = tally().csv(&plan());
        assert_eq!(csv.lines().count(), 1 + 2 * 2 * 2);
        assert!(csv.contains("v,none,RANSAC,1000,MSE,7.5,1,2,4,0.5000,0.1500,0.8500\n"), "{csv}");
        assert!(csv.contains("v,none,RANSAC,1000,MSE,7.5,2.5,3,4,0.7500,"), "{csv}");
        assert!(csv.contains("v,none,RANSAC,1000,INLIER,7.5,2.5,2,4,0.5000,"), "{csv}");
    }

    #[test]
    fn tables_show_rows_against_columns_and_the_rest_apart() {
        let text = tally().markdown(&plan(), "set");
        assert!(text.starts_with("# Table\n\n4 pairs of set.\n\n* a gap, settled\n"), "{text}");
        assert!(text.contains("### estimator RANSAC\n\n| metric \\ d_rmse (pr) | 1 | 2.5 |"), "{text}");
        assert!(text.contains("| MSE | 50.0 | 75.0 |\n| INLIER | 0.0 | 50.0 |\n"), "{text}");
        assert!(text.contains("| v, none | 25.0 % | 1 |"), "{text}");
        // At 2.5 pr: two pairs that MSE alone solves, one that INLIER alone solves.
        assert!(text.contains("| estimator 2SAC-GC, d_rmse (pr) 2.5 | MSE | 2 | 1 | 1.0000 |"), "{text}");
    }
}
