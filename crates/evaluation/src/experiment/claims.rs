//! The claims of the paper, compared with the measurements.
//!
//! Each claim is a statement on counts; whether it holds is computed for every data set separately and for all pairs
//! together. A yes or no does not show how much is due to chance; the figures beside it and the number of pairs do.

use super::{Cell, Count};
use std::fmt::Write;

/// The metrics that the paper proposes, in its order.
const PROPOSED: [&str; 6] = ["MAE", "MSE", "LOG-COSH", "EXP", "QUANTILE", "-QUANTILE"];
/// The metrics that the paper calls the best.
const BEST: [&str; 3] = ["MAE", "MSE", "LOG-COSH"];
/// The other metrics that it proposes.
const REST: [&str; 3] = ["EXP", "QUANTILE", "-QUANTILE"];
const BASELINE: &str = "INLIER";
/// Metrics on whole clouds.
const DENSE: [&str; 2] = ["PC Dist", "#OP"];
/// The paper's setting, unless a claim says otherwise.
const THRESHOLD_PR: f64 = 7.5;
const D_RMSE: f64 = 2.5;
const ITERATIONS: u64 = 1000;
/// Maximum difference that is "about the same", percentage points.
const SPREAD: f64 = 2.0;
/// Maximum variation that is "flat", percentage points, for thresholds of `FLAT_FROM` to `FLAT_TO` `pr`.
const FLAT: f64 = 5.0;
const FLAT_FROM: f64 = 5.0;
const FLAT_TO: f64 = 15.0;
/// Minimum factor by which dense metrics take longer.
const SLOWER: f64 = 1000.0;
/// Name for all data sets together.
const TOGETHER: &str = "all pairs";

/// One claim on one data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The claim of the paper.
    pub text: &'static str,
    /// The data set, or all pairs together.
    pub dataset: String,
    /// Whether it holds.
    pub holds: bool,
    /// The measurements.
    pub figures: String,
}

/// The measurements on some pairs.
pub struct Counts<'a> {
    /// The counts of each experiment, with its name.
    pub experiments: &'a [(String, Vec<Count>)],
}

/// Evaluates a claim on the counts of one data set: whether it holds, and the figures; `None` if it was not measured.
type Statement = fn(&[Count]) -> Option<(bool, String)>;

/// The experiment whose counts are used, the claim, and its evaluation.
const CLAIMS: [(&str, &str, Statement); 9] = [
    ("iterations", "every proposed metric is above INLIER at every number of iterations", above_baseline),
    ("estimators", "every proposed metric is above INLIER with every estimator", above_baseline),
    ("thresholds", "every proposed metric is above INLIER at every t", above_baseline),
    ("metrics", "MAE, MSE and LOG-COSH are within 2 points of each other", best_alike),
    ("metrics", "MAE, MSE and LOG-COSH are above EXP, QUANTILE and -QUANTILE", best_above_rest),
    ("thresholds", "MSE is flat in t from 5 to 15 pr (at most 5 points), INLIER is less flat", flat),
    ("estimators", "2SAC-GC is at least as good as RANSAC with MAE, MSE and LOG-COSH", two_point_helps),
    ("time", "metrics over correspondences are at least 1000 times faster than PC Dist and #OP", faster),
    ("nuisances", "PC Dist is ahead of the proposed metrics under holes, and nowhere else", ahead_under_holes),
];

/// Evaluates every claim for which the experiments have counts, on every data set and, if there are several, on all
/// pairs together.
#[must_use]
pub fn claims(counts: &Counts<'_>) -> Vec<Claim> {
    let mut claims = Vec::new();
    for (experiment, text, statement) in CLAIMS {
        let Some((_, all)) = counts.experiments.iter().find(|(name, _)| name == experiment) else { continue };
        for (dataset, counts) in by_dataset(all) {
            if let Some((holds, figures)) = statement(&counts) {
                claims.push(Claim { text, dataset, holds, figures });
            }
        }
    }
    claims
}

/// Returns the claims as a Markdown table.
#[must_use]
pub fn claims_table(claims: &[Claim]) -> String {
    let mut text =
        "# What the paper claims, and what was measured\n\nAt d_rmse 2.5 pr, t 7.5 pr and 1000 iterations unless \
                    stated otherwise; differences in percentage points.\n\n\
                    | claim | pairs | holds | figures |\n|---|---|---|---|\n"
            .to_owned();
    for Claim { text: claim, dataset, holds, figures } in claims {
        let holds = if *holds { "yes" } else { "no" };
        writeln!(text, "| {claim} | {dataset} | {holds} | {figures} |").expect("a string takes all");
    }
    text
}

/// Returns the counts of each data set, and of all together if there are several.
fn by_dataset(all: &[Count]) -> Vec<(String, Vec<Count>)> {
    let mut sets: Vec<(String, Vec<Count>)> = Vec::new();
    for count in all {
        match sets.iter_mut().find(|(name, _)| *name == count.dataset) {
            Some((_, counts)) => counts.push(count.clone()),
            None => sets.push((count.dataset.clone(), vec![count.clone()])),
        }
    }
    if sets.len() > 1 {
        sets.push((TOGETHER.to_owned(), together(all)));
    }
    sets
}

/// Adds up the cells of all data sets; times are averaged over the pairs.
fn together(all: &[Count]) -> Vec<Count> {
    let mut sums: Vec<Count> = Vec::new();
    for count in all {
        let same = |sum: &&mut Count| sum.cell == count.cell && sum.d_rmse == count.d_rmse;
        let Some(sum) = sums.iter_mut().find(same) else {
            sums.push(Count { dataset: TOGETHER.to_owned(), ..count.clone() });
            continue;
        };
        let (before, now) = (sum.total as f64, count.total as f64);
        let mean = |a: f64, b: f64| (before * a + now * b) / (before + now).max(1.0);
        sum.microseconds = sum.microseconds.zip(count.microseconds).map(|(a, b)| mean(a, b));
        sum.right += count.right;
        sum.total += count.total;
    }
    sums
}

/// Returns the counts at the paper's bound.
fn at_bound(counts: &[Count]) -> impl Iterator<Item = &Count> {
    counts.iter().filter(|count| count.d_rmse == D_RMSE)
}

/// Finds the count of the same cell for another metric.
fn ranked_by<'a>(counts: &'a [Count], like: &Count, metric: &str) -> Option<&'a Count> {
    let same = |other: &&Count| {
        other.cell.metric == metric
            && other.d_rmse == like.d_rmse
            && Cell { metric: like.cell.metric.clone(), ..other.cell.clone() } == like.cell
    };
    counts.iter().find(same)
}

fn above_baseline(counts: &[Count]) -> Option<(bool, String)> {
    let proposed = at_bound(counts).filter(|count| PROPOSED.contains(&&*count.cell.metric));
    let margins: Vec<(f64, &Count)> = proposed
        .filter_map(|count| Some((count.percent() - ranked_by(counts, count, BASELINE)?.percent(), count)))
        .collect();
    let &(least, at) = margins.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let above = margins.iter().filter(|(margin, _)| *margin > 0.0).count();
    let mean = margins.iter().map(|(margin, _)| margin).sum::<f64>() / margins.len() as f64;
    let Cell { metric, estimator, iterations, threshold_pr, .. } = &at.cell;
    let figures = format!(
        "above in {above} of {} cases, on average by {mean:+.1}; least {least:+.1}: {metric}, {estimator}, {iterations} iterations, t {threshold_pr} pr",
        margins.len()
    );
    Some((least > 0.0, figures))
}

/// Returns the accuracies of some metrics at the paper's setting, percent; `None` if one was not measured.
fn at_setting(counts: &[Count], metrics: &[&'static str]) -> Option<Vec<(f64, &'static str)>> {
    let of = |metric: &'static str| {
        let found = at_bound(counts).find(|count| {
            let Cell { metric: ranked, iterations, threshold_pr, .. } = &count.cell;
            ranked == metric && *iterations == ITERATIONS && *threshold_pr == THRESHOLD_PR
        });
        Some((found?.percent(), metric))
    };
    metrics.iter().map(|metric| of(metric)).collect()
}

fn listed(accuracies: &[(f64, &str)]) -> String {
    accuracies.iter().map(|(percent, metric)| format!("{metric} {percent:.1}")).collect::<Vec<_>>().join(", ")
}

fn lowest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

fn highest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

fn best_alike(counts: &[Count]) -> Option<(bool, String)> {
    let best = at_setting(counts, &BEST)?;
    let spread = highest(best.iter().map(|b| b.0)) - lowest(best.iter().map(|b| b.0));
    Some((spread <= SPREAD, format!("{}; {spread:.1} apart", listed(&best))))
}

fn best_above_rest(counts: &[Count]) -> Option<(bool, String)> {
    let (best, rest) = (at_setting(counts, &BEST)?, at_setting(counts, &REST)?);
    let margin = lowest(best.iter().map(|b| b.0)) - highest(rest.iter().map(|r| r.0));
    Some((margin > 0.0, format!("{}; {}; margin {margin:+.1}", listed(&best), listed(&rest))))
}

fn flat(counts: &[Count]) -> Option<(bool, String)> {
    let swing = |metric: &str| {
        let inside =
            |count: &&Count| count.cell.metric == metric && (FLAT_FROM..=FLAT_TO).contains(&count.cell.threshold_pr);
        let of = || at_bound(counts).filter(inside).map(Count::percent);
        (of().count() > 1).then(|| highest(of()) - lowest(of()))
    };
    let (mse, inlier) = (swing("MSE")?, swing(BASELINE)?);
    Some((mse <= FLAT && inlier > mse, format!("MSE moves by {mse:.1}, INLIER by {inlier:.1}")))
}

fn two_point_helps(counts: &[Count]) -> Option<(bool, String)> {
    let of = |estimator: &str, metric: &str| {
        at_bound(counts)
            .find(|count| count.cell.estimator == estimator && count.cell.metric == metric)
            .map(Count::percent)
    };
    let mut gains = Vec::new();
    for metric in BEST {
        gains.push((of("2SAC-GC", metric)? - of("RANSAC", metric)?, metric));
    }
    let figures: Vec<String> = gains.iter().map(|(gain, metric)| format!("{metric} {gain:+.1}")).collect();
    Some((gains.iter().all(|(gain, _)| *gain >= 0.0), figures.join(", ")))
}

fn faster(counts: &[Count]) -> Option<(bool, String)> {
    let times = |of: &[&str]| -> Vec<f64> {
        counts.iter().filter(|count| of.contains(&&*count.cell.metric)).filter_map(|count| count.microseconds).collect()
    };
    let mut sparse = PROPOSED.to_vec();
    sparse.push(BASELINE);
    let (sparse, dense) = (times(&sparse), times(&DENSE));
    if sparse.is_empty() || dense.is_empty() {
        return None;
    }
    let (slow, fast) = (highest(sparse.into_iter()), lowest(dense.into_iter()));
    let ratio = fast / slow;
    let figures =
        format!("slowest over correspondences {slow:.2} µs a pose, fastest over clouds {fast:.0} µs: {ratio:.0} times");
    Some((ratio >= SLOWER, figures))
}

fn ahead_under_holes(counts: &[Count]) -> Option<(bool, String)> {
    let lead = |count: &Count| {
        let proposed = PROPOSED.iter().filter_map(|metric| ranked_by(counts, count, metric)).map(Count::percent);
        count.percent() - highest(proposed)
    };
    let dense = || at_bound(counts).filter(|count| count.cell.metric == DENSE[0]);
    let leads = |holes: bool| {
        dense().filter(move |count| count.cell.nuisance.ends_with("holes") == holes).map(lead).collect::<Vec<_>>()
    };
    let (holes, elsewhere) = (leads(true), leads(false));
    if holes.is_empty() || elsewhere.is_empty() {
        return None;
    }
    let ahead = |leads: &[f64]| leads.iter().filter(|lead| **lead > 0.0).count();
    let figures = format!(
        "ahead at {} of {} levels of holes (at most {:+.1}), at {} of {} others (at most {:+.1})",
        ahead(&holes),
        holes.len(),
        highest(holes.iter().copied()),
        ahead(&elsewhere),
        elsewhere.len(),
        highest(elsewhere.iter().copied())
    );
    Some((ahead(&holes) > 0 && ahead(&elsewhere) == 0, figures))
}

#[cfg(test)]
mod tests;
