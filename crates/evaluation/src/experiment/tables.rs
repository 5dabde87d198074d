//! The results of an experiment as Markdown.

use super::groups::{distinct, groups, named, varying};
use super::tally::is_right;
use super::{Axis, Cell, Count, MeasuredOn, Plan, Shows, Tally};
use crate::statistics::{mcnemar, median, p_text, wilson};
use std::fmt::Write;

impl Tally {
    /// Returns the title, the notes and the tables.
    #[must_use]
    pub fn markdown(&self, plan: &Plan) -> String {
        let sets: Vec<String> = self.datasets.iter().map(|(name, pairs)| format!("{pairs} pairs of {name}")).collect();
        let mut text = format!("# {}\n\n{}.\n", plan.title, sets.join(", "));
        for note in &plan.notes {
            text += &format!("\n* {note}");
        }
        text.push('\n');
        match plan.shows {
            Shows::Accuracy => text += &self.accuracy_tables(plan),
            Shows::Inliers => text += &self.histogram_tables(),
            Shows::Time => text += &self.time_table(plan),
        }
        text + &self.inlier_table()
    }

    fn accuracy_tables(&self, plan: &Plan) -> String {
        let counts = self.counts(plan);
        let measured_on = match plan.measured_on {
            MeasuredOn::Scans => "the scans as provided",
            MeasuredOn::Sampled => "the sampled clouds",
        };
        let mut text = format!(
            "\n## Registration accuracy, %\n\nErrors are measured on {measured_on}, with d_rmse in units of their \
             resolution; thresholds are in units of the resolution of the sampled clouds.\n"
        );
        text += &pivot(plan, &counts, &|count: &Count| format!("{:.1}", count.percent()));
        let fewest = self.datasets.iter().map(|(_, pairs)| *pairs).min().unwrap_or(0);
        text += &format!("\n95 % intervals are in the CSV; at an accuracy of 50 % they are {}.\n", half_width(fewest));
        if let Some(baseline) = &plan.baseline {
            text += &self.baseline_table(plan, &counts, baseline);
        }
        text
    }

    /// Returns the median inlier ratio and number of inliers for each set of matches.
    fn inlier_table(&self) -> String {
        let mut text = "\n## True matches (within 5 pr after sampling)\n\n\
                        | data set | matches of | median ratio | median count |\n|---|---|---:|---:|\n"
            .to_owned();
        let mut seen = Vec::new();
        for column in &self.columns {
            let name = format!("{} | {}, {}", column.dataset, column.cell.variant, column.cell.nuisance);
            if seen.contains(&name) {
                continue;
            }
            let shares = || column.results.iter().map(|m| m.share);
            let ratio = median(&shares().map(|share| share.ratio()).collect::<Vec<_>>()).unwrap_or(0.0);
            let count = median(&shares().map(|share| share.inliers as f64).collect::<Vec<_>>()).unwrap_or(0.0);
            text += &format!("| {name} | {:.1} % | {count:.0} |\n", 100.0 * ratio);
            seen.push(name);
        }
        text
    }

    fn time_table(&self, plan: &Plan) -> String {
        let mut text = "\n## Time for one pose, one thread\n\n| data set | estimator | metric | mean, microseconds | times MSE |\n|---|---|---|---:|---:|\n".to_owned();
        let counts = self.counts(plan);
        let of_mse = |count: &Count| {
            let is_mse = |other: &&Count| {
                other.dataset == count.dataset && other.cell == Cell { metric: "MSE".into(), ..count.cell.clone() }
            };
            counts.iter().find(is_mse).and_then(|mse| mse.microseconds)
        };
        for count in &counts {
            let Some(time) = count.microseconds else { continue };
            let ratio = of_mse(count).map_or("-".to_owned(), |mse| format!("{:.1}", time / mse));
            let (dataset, Cell { estimator, metric, .. }) = (&count.dataset, &count.cell);
            writeln!(text, "| {dataset} | {estimator} | {metric} | {time:.2} | {ratio} |").expect("a string takes all");
        }
        text
    }

    /// Compares every metric with the baseline, all else being equal.
    fn baseline_table(&self, plan: &Plan, counts: &[Count], baseline: &str) -> String {
        let mut text = format!(
            "\n## Against {baseline} (McNemar's exact test, two-sided)\n\n| case | metric | alone right | {baseline} alone right | p |\n|---|---|---:|---:|---:|\n"
        );
        let varying = varying(counts, |axis| axis != Axis::Metric);
        for column in self.columns.iter().filter(|column| column.cell.metric != baseline) {
            let is_baseline = |other: &&super::tally::Column| {
                other.dataset == column.dataset
                    && other.cell.metric == baseline
                    && other.cell == Cell { metric: other.cell.metric.clone(), ..column.cell.clone() }
            };
            let Some(other) = self.columns.iter().find(is_baseline) else { continue };
            for &d_rmse in &plan.d_rmse {
                let both = || column.results.iter().zip(&other.results);
                let alone = both().filter(|(a, b)| is_right(a, d_rmse) && !is_right(b, d_rmse)).count();
                let other = both().filter(|(a, b)| !is_right(a, d_rmse) && is_right(b, d_rmse)).count();
                let (dataset, cell) = (column.dataset.clone(), column.cell.clone());
                let count = Count { dataset, cell, d_rmse, right: 0, total: 0, microseconds: None };
                let (case, p) = (named(&count, &varying), p_text(mcnemar(alone, other)));
                text += &format!("| {case} | {} | {alone} | {other} | {p} |\n", column.cell.metric);
            }
        }
        text
    }
}

fn half_width(pairs: usize) -> String {
    let (low, high) = wilson(pairs / 2, pairs);
    format!("±{:.0} points", 50.0 * (high - low))
}

/// Formats one table of rows against columns for each combination of all else that varies.
fn pivot(plan: &Plan, counts: &[Count], shown: &dyn Fn(&Count) -> String) -> String {
    let mut text = String::new();
    for (table, inside) in groups(counts, [plan.rows, plan.columns]) {
        let columns = distinct(inside.iter().map(|count| count.value(plan.columns)));
        if !table.is_empty() {
            text += &format!("\n### {table}\n");
        }
        let corner = format!("{} \\ {}", plan.rows.name(), plan.columns.name());
        text += &format!("\n| {corner} | {} |\n|---|{}\n", columns.join(" | "), "---:|".repeat(columns.len()));
        for name in distinct(inside.iter().map(|count| count.value(plan.rows))) {
            let at = |c: &String| inside.iter().find(|e| e.value(plan.rows) == name && e.value(plan.columns) == *c);
            let line: Vec<String> = columns.iter().map(|c| at(c).map_or("-".to_owned(), |e| shown(e))).collect();
            text += &format!("| {name} | {} |\n", line.join(" | "));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::tally::tests::{measured, plan, tally};
    use super::*;
    use crate::experiment::Measured;

    #[test]
    fn tables_show_rows_against_columns_and_the_rest_apart() {
        let text = tally().markdown(&plan());
        assert!(text.starts_with("# Table\n\n4 pairs of set.\n\n* a gap, settled\n"), "{text}");
        assert!(text.contains("### estimator RANSAC\n\n| metric \\ d_rmse (pr) | 1 | 2.5 |"), "{text}");
        assert!(text.contains("| MSE | 50.0 | 75.0 |\n| INLIER | 0.0 | 50.0 |\n"), "{text}");
        assert!(text.contains("| set | v, none | 25.0 % | 1 |"), "{text}");
        // At 2.5 pr: two pairs that only MSE solves, one that only INLIER solves.
        assert!(text.contains("| estimator 2SAC-GC, d_rmse (pr) 2.5 | MSE | 2 | 1 | 1.0000 |"), "{text}");
    }

    #[test]
    fn times_are_compared_with_that_of_mse() {
        let mut tally = Tally::default();
        let timed = |metric, time| Measured { microseconds: Some(time), ..measured("RANSAC", metric, 1.0) };
        tally.add("set", vec![timed("MSE", 0.5), timed("PC Dist", 1000.0)]);
        let text = tally.markdown(&Plan { shows: Shows::Time, d_rmse: vec![2.5], ..plan() });
        assert!(text.contains("| set | RANSAC | PC Dist | 1000.00 | 2000.0 |"), "{text}");
        assert!(!text.contains("accuracy"), "{text}");
    }
}
