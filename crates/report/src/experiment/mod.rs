//! The page of experiments: figures arranged as in the paper, and the tables.

mod curves;
mod inliers;

pub(crate) use curves::accuracy;

use crate::page::{Block, Page};
use crate::pair::ending;
use crate::printed::blocks_of;
use congruent_evaluation::experiment::{Plan, Shows, Tally};

/// One experiment with its results.
pub struct ExperimentReport<'a> {
    /// Short name, used for file names.
    pub name: &'a str,
    /// What was varied.
    pub plan: &'a Plan,
    /// The results.
    pub tally: &'a Tally,
    /// The text written by [`Tally::markdown`], with what was added to it.
    pub text: &'a str,
}

/// A figure for a paper: a name that can be used for a file, a caption, the SVG.
pub struct Figure {
    /// Letters, digits and hyphens.
    pub name: String,
    /// What is shown.
    pub caption: String,
    /// The complete SVG file.
    pub svg: String,
}

/// Returns the page of experiments on data sets; `more` is text that belongs to all of them.
#[must_use]
pub fn experiment_page(
    datasets: &str,
    reports: &[ExperimentReport<'_>],
    more: &str,
    config: &str,
    version: &str,
) -> Page {
    let mut blocks = Vec::new();
    for report in reports {
        let mut text = blocks_of(report.text);
        let figures = experiment_figures(report);
        let figures = Block::Figures(figures.into_iter().map(|figure| (figure.caption, figure.svg)).collect());
        // After the title, the number of pairs and the notes.
        let place = text.iter().position(|block| matches!(block, Block::Subsection(_))).unwrap_or(text.len());
        text.insert(place, figures);
        blocks.extend(text);
    }
    blocks.extend(blocks_of(more));
    blocks.extend(ending(config, version));
    Page { title: format!("Experiments on {datasets}"), subtitle: String::new(), blocks }
}

/// Returns curves of accuracy or of time, or histograms of the true matches, as the plan specifies.
#[must_use]
pub fn experiment_figures(report: &ExperimentReport<'_>) -> Vec<Figure> {
    let entries = report.tally.counts(report.plan);
    match report.plan.shows {
        Shows::Accuracy => curves::frames(report, &entries, &curves::of_accuracy()),
        Shows::Time => curves::frames(report, &entries, &curves::of_time(&entries)),
        Shows::Inliers => inliers::histograms(report),
    }
}

fn file_name(name: &str, group: &str) -> String {
    let both = format!("{name} {group}");
    let words = both.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}
