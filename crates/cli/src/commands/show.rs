//! `congruent evaluate --show`: one pair of a data set, in 3D, with the errors of all points against the truth.

use super::align::{RawSource, align, names_of, unbounded};
use super::dataset::{files_of, select};
use crate::args::{EvaluateArgs, RunArgs};
use crate::output;
use anyhow::{Context, Result, bail};
use congruent_io::{TruePair, write_file};
use congruent_pipeline::Pair;
use congruent_report::{comparison_page, pair_page};
use std::process::ExitCode;

pub(super) fn run(args: &EvaluateArgs, wanted: &str) -> Result<ExitCode> {
    let path = args.page.report.as_ref().context("--show needs --report FILE for its page")?;
    let selected = select(&args.dataset)?;
    args.page.check(&files_of(&selected), &[])?;
    let pairs: Vec<&TruePair> = selected.iter().flat_map(|set| &set.pairs).collect();
    let pair = find(&pairs, wanted)?;
    let files = Pair { source: pair.source_file.as_path(), target: pair.target_file.as_path() };
    let ways: Vec<(String, RunArgs)> = match args.metrics.as_slice() {
        [] => vec![(String::new(), args.run.clone())],
        metrics => metrics.iter().map(|metric| (metric.clone(), by_metric(&args.run, metric))).collect(),
    };
    let mut answers = Vec::new();
    for (name, run) in &ways {
        let aligned = align(files, Pair::default(), run, RawSource::Dropped, &unbounded)?;
        output::data(format!("{name}\n{}", aligned.report.summary()).trim_start_matches('\n'))?;
        let text = toml::to_string(&aligned.config)?;
        answers.push((name.clone(), aligned, text));
    }
    let names = names_of(files);
    let mut reports: Vec<_> = answers
        .iter()
        .map(|(name, aligned, text)| (name.clone(), aligned.page_of(&names, text, Some(&pair.target_from_source))))
        .collect();
    let page = if reports.len() == 1 { pair_page(&reports.remove(0).1) } else { comparison_page(&reports) };
    write_file(path, page.html().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Finds the pair of that name.
fn find<'a>(pairs: &[&'a TruePair], wanted: &str) -> Result<&'a TruePair> {
    let name = |pair: &&TruePair| format!("{},{}", pair.source, pair.target);
    match pairs.iter().copied().find(|pair| name(pair) == wanted) {
        Some(pair) => Ok(pair),
        None => {
            let some: Vec<String> = pairs.iter().take(5).map(name).collect();
            bail!("{wanted}: is not one of the {} pairs: {} …", pairs.len(), some.join(" "))
        }
    }
}

fn by_metric(run: &RunArgs, metric: &str) -> RunArgs {
    let set = run.set.iter().cloned().chain([format!("metric={metric}")]).collect();
    RunArgs { set, ..run.clone() }
}
