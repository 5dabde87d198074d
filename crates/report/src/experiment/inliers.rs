//! Figure 5: histograms over pairs of the fraction of true matches, and of their number.

use super::{ExperimentReport, Figure, file_name};
use crate::figures::{Bars, round_up};

/// Number of bars in a histogram; those of the fraction are as wide as the bins of the table.
const BARS: usize = 20;

/// Returns two histograms for each data set and each change to its matches.
pub(super) fn histograms(report: &ExperimentReport<'_>) -> Vec<Figure> {
    let mut figures = Vec::new();
    for (name, shares) in report.tally.shares() {
        let ratios: Vec<f64> = shares.iter().map(|share| 100.0 * share.ratio()).collect();
        let counts: Vec<f64> = shares.iter().map(|share| share.inliers as f64).collect();
        let most = round_up(counts.iter().copied().fold(1.0, f64::max));
        let mut add = |of: &str, bars: Bars| {
            let group = format!("{of}, {name}");
            let caption = format!("{}: {group}", report.plan.title);
            figures.push(Figure { name: file_name(report.name, &group), caption, svg: bars.svg() });
        };
        add("share of true matches", Bars::counted("true matches, %", &ratios, 100.0, BARS));
        add("number of true matches", Bars::counted("true matches", &counts, most, BARS));
    }
    figures
}
