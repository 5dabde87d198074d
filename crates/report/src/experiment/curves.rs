//! Curves arranged as in the paper: accuracy, or the time of the metrics.

use super::{ExperimentReport, Figure, file_name};
use crate::figures::{Axis as Across, Curve, Curves, Measure, Sample};
use congruent_evaluation::experiment::{Axis, Count, Nuisance, Plan, distinct, groups};
use congruent_evaluation::statistics::wilson;

/// Maximum number of curves that can be distinguished in one frame.
const MAX_CURVES: usize = 10;

/// The vertical measure, and its value for a cell, if any.
pub(super) struct Upward {
    pub(super) measure: Measure,
    pub(super) sample: fn(f64, &Count) -> Option<Sample>,
}

/// Returns accuracy with Wilson's 95 % intervals.
pub(super) fn of_accuracy() -> Upward {
    Upward { measure: Measure::percent("accuracy, %"), sample: |x, entry| Some(accuracy(x, entry.right, entry.total)) }
}

/// Returns the time for one pose; all decades have the same height.
pub(super) fn of_time(entries: &[Count]) -> Upward {
    let times = entries.iter().filter_map(|entry| entry.microseconds);
    Upward {
        measure: Measure::decades("time of a pose, µs", times),
        sample: |x, entry| Some(Sample { x, y: entry.microseconds?.log10(), interval: None }),
    }
}

/// Returns a curve for each row of the plan over its columns, with a frame for each combination of everything else that
/// varies. Rows and columns are swapped if there would be too many curves. Each nuisance has frames of its own, over its
/// level.
pub(super) fn frames(report: &ExperimentReport<'_>, entries: &[Count], upward: &Upward) -> Vec<Figure> {
    let plan = report.plan;
    let many = distinct(entries.iter().map(|entry| entry.value(plan.rows))).len() > MAX_CURVES;
    let (rows, columns) = if many { (plan.columns, plan.rows) } else { (plan.rows, plan.columns) };
    let frames = groups(entries, [rows, columns]).into_iter().flat_map(|(group, inside)| match columns {
        Axis::Nuisance => over_levels(plan, &group, &inside),
        _ => {
            let (placed, across) = placed(&inside, columns);
            vec![(group, placed, across)]
        }
    });
    frames
        .map(|(group, placed, x)| {
            let names = distinct(placed.iter().map(|(_, entry)| entry.value(rows)));
            let curve = |name: String| Curve {
                samples: placed
                    .iter()
                    .filter(|(_, e)| e.value(rows) == name)
                    .filter_map(|(x, e)| (upward.sample)(*x, e))
                    .collect(),
                name: if numbers(&[name.as_str()]).is_some() { format!("{} {name}", rows.name()) } else { name },
            };
            let curves = Curves { x, y: upward.measure.clone(), curves: names.into_iter().map(curve).collect() };
            let caption = if group.is_empty() { plan.title.clone() } else { format!("{}: {group}", plan.title) };
            Figure { name: file_name(report.name, &group), caption, svg: curves.svg() }
        })
        .collect()
}

/// The horizontal position of an entry.
type Placed<'a> = (f64, &'a Count);

/// The name of a frame, what it shows, and its horizontal axis.
type Frame<'a> = (String, Vec<Placed<'a>>, Across);

/// Places entries at the numbers of an axis, or otherwise at its names in order.
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

/// Returns a frame of a group for each kind of nuisance, over its level; the unchanged scans are where the nuisance has
/// no effect.
fn over_levels<'a>(plan: &Plan, group: &str, entries: &[&'a Count]) -> Vec<Frame<'a>> {
    let kinds = distinct(plan.nuisances.iter().filter_map(|n| level(n).map(|(kind, ..)| kind.to_owned())));
    let frame = |kind: String| {
        let at = |nuisance: &Nuisance| match level(nuisance) {
            Some((of, level, _)) => (of == kind).then_some(level),
            None => plan.nuisances.iter().filter_map(level).find(|(of, ..)| *of == kind).map(|(.., nothing)| nothing),
        };
        let places: Vec<(String, f64)> = plan.nuisances.iter().filter_map(|n| Some((n.to_string(), at(n)?))).collect();
        let place = |entry: &Count| places.iter().find(|(name, _)| *name == entry.value(Axis::Nuisance)).map(|p| p.1);
        let mut placed: Vec<Placed<'a>> = entries.iter().filter_map(|entry| Some((place(entry)?, *entry))).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let name = if group.is_empty() { kind.clone() } else { format!("{kind}, {group}") };
        (name, placed, Across::Numbers(kind))
    };
    kinds.into_iter().map(frame).collect()
}

/// Returns the name of a nuisance, its level, and the level at which it has no effect.
fn level(nuisance: &Nuisance) -> Option<(&'static str, f64, f64)> {
    match *nuisance {
        Nuisance::None {} => None,
        Nuisance::Noise(sigma) => Some(("noise, pr", sigma, 0.0)),
        Nuisance::KeepEvenly(share) => Some(("points kept evenly, %", 100.0 * share, 100.0)),
        Nuisance::KeepRandomly(share) => Some(("points kept randomly, %", 100.0 * share, 100.0)),
        Nuisance::Holes(count) => Some(("holes", count as f64, 0.0)),
        Nuisance::Strays(share) => Some(("strays, %", 100.0 * share, 0.0)),
    }
}

/// Returns a fraction in percent with its interval.
pub(crate) fn accuracy(x: f64, right: usize, total: usize) -> Sample {
    let (low, high) = wilson(right, total);
    let y = 100.0 * right as f64 / total.max(1) as f64;
    Sample { x, y, interval: Some((100.0 * low, 100.0 * high)) }
}

fn numbers<S: AsRef<str>>(values: &[S]) -> Option<Vec<f64>> {
    values.iter().map(|value| value.as_ref().parse::<f64>().ok().filter(|v| v.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment_figures;
    use congruent_evaluation::InlierShare;
    use congruent_evaluation::experiment::{Cell, Measured, MeasuredOn, Shows, Tally};

    const NUISANCES: [Nuisance; 4] =
        [Nuisance::None {}, Nuisance::Noise(0.5), Nuisance::Noise(1.0), Nuisance::Strays(0.1)];

    fn plan() -> Plan {
        Plan {
            title: "Nuisances".to_owned(),
            notes: Vec::new(),
            shows: Shows::Accuracy,
            rows: Axis::Metric,
            columns: Axis::Nuisance,
            variants: Vec::new(),
            nuisances: NUISANCES.to_vec(),
            estimators: Vec::new(),
            metrics: Vec::new(),
            thresholds_pr: vec![7.5],
            iterations: vec![1000],
            d_rmse: vec![2.5],
            measured_on: MeasuredOn::Scans,
            baseline: None,
        }
    }

    fn measured(variant: &str, nuisance: Nuisance) -> Measured {
        let cell = Cell {
            variant: variant.to_owned(),
            nuisance: nuisance.to_string(),
            estimator: "RANSAC".into(),
            iterations: 1000,
            metric: "MSE".into(),
            threshold_pr: 7.5,
        };
        Measured { cell, rmse_pr: Some(1.0), share: InlierShare::default(), microseconds: None }
    }

    /// Returns the names of the figures on data sets and variants.
    fn named(datasets: &[&str], variants: &[&str]) -> Vec<String> {
        let mut tally = Tally::default();
        for dataset in datasets {
            let all = variants.iter().flat_map(|variant| NUISANCES.map(|nuisance| measured(variant, nuisance)));
            tally.add(dataset, all.collect());
        }
        let figures = experiment_figures(&ExperimentReport { name: "n", plan: &plan(), tally: &tally, text: "" });
        figures.into_iter().map(|figure| figure.name).collect()
    }

    #[test]
    fn nuisances_of_different_data_sets_and_variants_are_not_in_one_frame() {
        assert_eq!(named(&["a"], &["v"]), ["n-noise-pr", "n-strays"]);
        let expected = ["n-noise-pr-data-set-a", "n-strays-data-set-a", "n-noise-pr-data-set-b", "n-strays-data-set-b"];
        assert_eq!(named(&["a", "b"], &["v"]), expected);
        assert_eq!(named(&["a", "b"], &["v", "w"]).len(), 8);
    }
}
