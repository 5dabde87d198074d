//! The page of experiments: curves in the paper's arrangement, and the tables.

use crate::figures::{Axis as Across, Curve, Curves, Sample};
use crate::page::{Block, Page};
use crate::pair::ending;
use crate::printed::blocks_of;
use congruent_evaluation::experiment::{Axis, Count, Nuisance, Plan, Tally};
use congruent_evaluation::statistics::wilson;

/// Curves that can be told apart in one frame.
const MAX_CURVES: usize = 10;

/// One experiment with its results.
pub struct ExperimentReport<'a> {
    /// Short name, of files.
    pub name: &'a str,
    /// What was varied.
    pub plan: &'a Plan,
    /// What came out.
    pub tally: &'a Tally,
    /// As [`Tally::markdown`] writes it, with what was added to it.
    pub text: &'a str,
}

/// A figure for a paper: a name that can be a file's, a caption, the SVG.
pub struct Figure {
    /// Letters, digits and hyphens.
    pub name: String,
    /// What is shown.
    pub caption: String,
    /// The whole file.
    pub svg: String,
}

/// The page of experiments on data sets; `more` is text that belongs to all of them.
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

/// Accuracy with Wilson's 95 % intervals: a curve for each row of the plan over its columns, a frame for each combination of
/// all else that varies. Rows and columns change places where there would be too many curves. Nuisances have a frame each,
/// over their level.
#[must_use]
pub fn experiment_figures(report: &ExperimentReport<'_>) -> Vec<Figure> {
    let (plan, entries) = (report.plan, report.tally.counts(report.plan));
    let many = distinct(entries.iter().map(|entry| entry.value(plan.rows))).len() > MAX_CURVES;
    let (rows, columns) = if many { (plan.columns, plan.rows) } else { (plan.rows, plan.columns) };
    let frames: Vec<(String, Vec<Placed<'_>>, Across)> = if columns == Axis::Nuisance {
        nuisance_frames(plan, &entries)
    } else {
        let groups = distinct(entries.iter().map(|entry| rest(entry, &entries, rows, columns)));
        let frame = |group: String| {
            let inside: Vec<&Count> =
                entries.iter().filter(|entry| rest(entry, &entries, rows, columns) == group).collect();
            let (placed, across) = placed(&inside, columns);
            (group, placed, across)
        };
        groups.into_iter().map(frame).collect()
    };
    frames
        .into_iter()
        .map(|(group, placed, x)| {
            let names = distinct(placed.iter().map(|(_, entry)| entry.value(rows)));
            let curve = |name: String| Curve {
                samples: placed.iter().filter(|(_, e)| e.value(rows) == name).map(|(x, e)| sample(*x, e)).collect(),
                name: if numbers(&[name.as_str()]).is_some() { format!("{} {name}", rows.name()) } else { name },
            };
            let curves =
                Curves { x, y: "accuracy, %", range: (0.0, 100.0), curves: names.into_iter().map(curve).collect() };
            let caption = if group.is_empty() { plan.title.clone() } else { format!("{}: {group}", plan.title) };
            Figure { name: file_name(report.name, &group), caption, svg: curves.svg() }
        })
        .collect()
}

/// Where across an entry is.
type Placed<'a> = (f64, &'a Count);

/// Places entries at the numbers of an axis, or else at the names in order.
fn placed<'a>(entries: &[&'a Count], axis: Axis) -> (Vec<Placed<'a>>, Across) {
    let values: Vec<String> = entries.iter().map(|entry| entry.value(axis)).collect();
    if let Some(numbers) = numbers(&values) {
        return (numbers.into_iter().zip(entries.iter().copied()).collect(), Across::Numbers(axis.name().to_owned()));
    }
    let names = distinct(values.iter().cloned());
    let place = |value: &String| names.iter().position(|name| name == value).unwrap_or(0) as f64;
    let placed = values.iter().map(place).zip(entries.iter().copied()).collect();
    (placed, Across::Names(names))
}

/// A frame for each kind of nuisance, over its level; the unspoilt scans are where it does nothing.
fn nuisance_frames<'a>(plan: &Plan, entries: &'a [Count]) -> Vec<(String, Vec<Placed<'a>>, Across)> {
    let kinds = distinct(plan.nuisances.iter().filter_map(|n| level(n).map(|(kind, ..)| kind.to_owned())));
    let frame = |kind: String| {
        let at = |nuisance: &Nuisance| match level(nuisance) {
            Some((of, level, _)) => (of == kind).then_some(level),
            None => plan.nuisances.iter().filter_map(level).find(|(of, ..)| *of == kind).map(|(.., nothing)| nothing),
        };
        let places: Vec<(String, f64)> = plan.nuisances.iter().filter_map(|n| Some((n.to_string(), at(n)?))).collect();
        let place = |entry: &Count| places.iter().find(|(name, _)| *name == entry.value(Axis::Nuisance)).map(|p| p.1);
        let mut placed: Vec<Placed<'_>> = entries.iter().filter_map(|entry| Some((place(entry)?, entry))).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        (kind.clone(), placed, Across::Numbers(kind))
    };
    kinds.into_iter().map(frame).collect()
}

/// What a nuisance is, how much of it, and how much is nothing.
fn level(nuisance: &Nuisance) -> Option<(&'static str, f64, f64)> {
    match *nuisance {
        Nuisance::None {} => None,
        Nuisance::Noise(sigma) => Some(("noise, pr", sigma, 0.0)),
        Nuisance::KeepEvenly(share) => Some(("points kept evenly, %", 100.0 * share, 100.0)),
        Nuisance::KeepRandomly(share) => Some(("points kept randomly, %", 100.0 * share, 100.0)),
        Nuisance::Holes(count) => Some(("holes", count as f64, 0.0)),
    }
}

pub(crate) fn sample(x: f64, entry: &Count) -> Sample {
    accuracy(x, entry.right, entry.total)
}

/// A share in percent with its interval.
pub(crate) fn accuracy(x: f64, right: usize, total: usize) -> Sample {
    let (low, high) = wilson(right, total);
    let y = 100.0 * right as f64 / total.max(1) as f64;
    Sample { x, y, interval: Some((100.0 * low, 100.0 * high)) }
}

/// What tells an entry's frame from the others.
fn rest(entry: &Count, all: &[Count], rows: Axis, columns: Axis) -> String {
    let others = Axis::ALL.into_iter().filter(|axis| *axis != rows && *axis != columns);
    let varying = others.filter(|axis| all.iter().any(|other| other.value(*axis) != all[0].value(*axis)));
    varying.map(|axis| format!("{} {}", axis.name(), entry.value(axis))).collect::<Vec<_>>().join(", ")
}

fn numbers<S: AsRef<str>>(values: &[S]) -> Option<Vec<f64>> {
    values.iter().map(|value| value.as_ref().parse::<f64>().ok().filter(|v| v.is_finite())).collect()
}

/// Each once, in the order of the first appearance.
fn distinct(values: impl Iterator<Item = String>) -> Vec<String> {
    let mut seen: Vec<String> = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

fn file_name(name: &str, group: &str) -> String {
    let both = format!("{name} {group}");
    let words = both.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}
