//! Figure 5: the number of pairs by their number and fraction of true matches.

use super::Tally;
use super::tally::Column;
use crate::InlierShare;
use congruent_io::csv_line;

/// Width of a bin of the inlier ratio, percent.
const PERCENT_STEP: usize = 5;
/// Lower bounds of the bins of the number of true matches. Fewer than three cannot determine a pose.
const NUMBERS_FROM: [usize; 8] = [0, 3, 10, 20, 50, 100, 200, 500];

/// A quantity that is counted in bins.
struct Quantity {
    name: &'static str,
    title: &'static str,
    /// Lower bounds of the bins; the last one has no upper bound.
    from: Vec<usize>,
    of: fn(&InlierShare) -> f64,
}

fn quantities() -> [Quantity; 2] {
    [
        Quantity {
            name: "inlier_ratio_percent",
            title: "Share of true matches, %",
            from: (0..100).step_by(PERCENT_STEP).collect(),
            of: |share| 100.0 * share.ratio(),
        },
        Quantity {
            name: "inliers",
            title: "Number of true matches",
            from: NUMBERS_FROM.to_vec(),
            of: |share| share.inliers as f64,
        },
    ]
}

impl Quantity {
    /// Returns the number of pairs in each bin.
    fn pairs(&self, column: &Column) -> Vec<usize> {
        let mut pairs = vec![0; self.from.len()];
        for measured in &column.results {
            let value = (self.of)(&measured.share);
            let bin = self.from.iter().rposition(|&from| from as f64 <= value).unwrap_or(0);
            pairs[bin] += 1;
        }
        pairs
    }

    fn bin(&self, number: usize) -> String {
        let from = self.from[number];
        self.from.get(number + 1).map_or(format!("{from} and more"), |to| format!("{from} to below {to}"))
    }
}

impl Tally {
    /// Returns the histograms as CSV, one line for each bin.
    pub(super) fn histogram_csv(&self) -> String {
        let mut text = csv_line(["dataset", "variant", "nuisance", "quantity", "from", "below", "pairs"]) + "\n";
        for column in &self.columns {
            for quantity in quantities() {
                for (bin, pairs) in quantity.pairs(column).iter().enumerate() {
                    let below = quantity.from.get(bin + 1).map_or(String::new(), ToString::to_string);
                    let (from, pairs) = (quantity.from[bin].to_string(), pairs.to_string());
                    let names = [&column.dataset, &column.cell.variant, &column.cell.nuisance].map(String::as_str);
                    text += &csv_line(names.into_iter().chain([quantity.name, &from, &below, &pairs]));
                    text.push('\n');
                }
            }
        }
        text
    }

    /// Returns one Markdown table for each quantity; bins that are empty for all data sets are left out.
    pub(super) fn histogram_tables(&self) -> String {
        let mut text = String::new();
        for quantity in quantities() {
            let columns: Vec<Vec<usize>> = self.columns.iter().map(|column| quantity.pairs(column)).collect();
            let names: Vec<&str> = self.columns.iter().map(|column| column.dataset.as_str()).collect();
            text += &format!("\n## {}: pairs in each bin\n\n| bin | {} |\n", quantity.title, names.join(" | "));
            text += &format!("|---|{}\n", "---:|".repeat(names.len()));
            for bin in (0..quantity.from.len()).filter(|&bin| columns.iter().any(|pairs| pairs[bin] > 0)) {
                let line: Vec<String> = columns.iter().map(|pairs| pairs[bin].to_string()).collect();
                text += &format!("| {} | {} |\n", quantity.bin(bin), line.join(" | "));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::super::tally::tests::{measured, plan};
    use super::*;
    use crate::experiment::{Measured, Plan, Shows};

    #[test]
    fn every_pair_is_in_one_bin_of_each_quantity() {
        let mut tally = Tally::default();
        for (inliers, matches) in [(0, 0), (1, 100), (5, 100), (9, 100), (100, 100), (600, 1200)] {
            let share = InlierShare { inliers, matches };
            tally.add("set", vec![Measured { share, ..measured("", "", 1.0) }]);
        }
        let csv = tally.csv(&Plan { shows: Shows::Inliers, ..plan() });
        for line in ["inlier_ratio_percent,0,5,2", "inlier_ratio_percent,5,10,2", "inlier_ratio_percent,95,,1"] {
            assert!(csv.contains(&format!("set,v,none,{line}\n")), "{line}\n{csv}");
        }
        for line in ["inliers,0,3,2", "inliers,3,10,2", "inliers,100,200,1", "inliers,500,,1"] {
            assert!(csv.contains(&format!("set,v,none,{line}\n")), "{line}\n{csv}");
        }
        let tables = tally.histogram_tables();
        assert!(tables.contains("| 5 to below 10 | 2 |") && tables.contains("| 500 and more | 1 |"), "{tables}");
        assert!(!tables.contains("| 10 to below 15 |"), "{tables}");
    }
}
