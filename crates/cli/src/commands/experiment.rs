//! `congruent experiment`: the tables and figures of the paper on a data set.

use super::dataset::{Selected, select};
use super::on_threads;
use super::pages::write_pages;
use crate::args::{ExperimentArgs, RunArgs};
use crate::progress::Bar;
use crate::{configuration, output};
use anyhow::{Context, Result, anyhow};
use congruent_evaluation::csv_line;
use congruent_evaluation::experiment::{Plan, Tally, run_pair};
use congruent_io::{TruePair, read_scan, write_file};
use congruent_pipeline::{Pair, PipelineConfig};
use congruent_report::{ExperimentReport, experiment_figures, experiment_page};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The experiments, as they are written in `configs/experiments/`.
pub(crate) const PLANS: [(&str, &str); 8] = [
    ("iterations", include_str!("../../../../configs/experiments/iterations.toml")),
    ("estimators", include_str!("../../../../configs/experiments/estimators.toml")),
    ("thresholds", include_str!("../../../../configs/experiments/thresholds.toml")),
    ("threshold-rmse", include_str!("../../../../configs/experiments/threshold-rmse.toml")),
    ("metrics", include_str!("../../../../configs/experiments/metrics.toml")),
    ("nuisances", include_str!("../../../../configs/experiments/nuisances.toml")),
    ("variants", include_str!("../../../../configs/experiments/variants.toml")),
    ("time", include_str!("../../../../configs/experiments/time.toml")),
];
/// The chain of the experiments, if no other is named.
const PRESET: &str = "paper";

pub(super) fn run(args: &ExperimentArgs) -> Result<ExitCode> {
    let plans = plans(&args.experiment)?;
    let selected = select(&args.dataset)?;
    std::fs::create_dir_all(&args.output).with_context(|| format!("{}: cannot be created", args.output.display()))?;
    let mut done = Vec::new();
    for (name, plan) in &plans {
        let variants = variants(plan, &args.run)?;
        let run = Run { name, plan, variants: &variants, selected: &selected, output: &args.output };
        let (tally, text) = on_threads(args.run.threads, || run.all())??;
        output::data(text.trim_end());
        done.push((name, plan, tally, text));
    }
    let reports: Vec<ExperimentReport<'_>> =
        done.iter().map(|(name, plan, tally, text)| ExperimentReport { name, plan, tally, text }).collect();
    let config = toml::to_string(&configuration::resolve(&on_preset(&args.run))?)?;
    write_pages(
        &args.page,
        || experiment_page(&selected.name, &reports, &config, env!("CARGO_PKG_VERSION")),
        || reports.iter().flat_map(experiment_figures).collect(),
    )?;
    Ok(ExitCode::SUCCESS)
}

/// All of them, the one of that name, or one from a file.
fn plans(wanted: &str) -> Result<Vec<(String, Plan)>> {
    let built_in = PLANS.iter().filter(|(name, _)| wanted == "all" || wanted == *name);
    let mut plans = Vec::new();
    for (name, text) in built_in {
        plans.push(((*name).to_owned(), parse(text, name)?));
    }
    if plans.is_empty() {
        let path = Path::new(wanted);
        let names = PLANS.map(|p| p.0).join(", ");
        let text = std::fs::read_to_string(path).map_err(|error| {
            anyhow!("{wanted}: is no experiment and cannot be read ({error}); there are: {names}, all")
        })?;
        let stem = path.file_stem().map_or("experiment".into(), |stem| stem.to_string_lossy().into_owned());
        plans.push((stem, parse(&text, wanted)?));
    }
    Ok(plans)
}

fn parse(text: &str, name: &str) -> Result<Plan> {
    toml::from_str(text).map_err(|error| anyhow!("{name}: {}", error.to_string().trim()))
}

/// The plan's changes, applied to what the command line describes.
fn variants(plan: &Plan, run: &RunArgs) -> Result<Vec<(String, PipelineConfig)>> {
    let of = |variant: &congruent_evaluation::experiment::Variant| {
        let set = run.set.iter().chain(&variant.set).cloned().collect();
        let all = RunArgs { set, ..on_preset(run) };
        let config = configuration::resolve(&all).with_context(|| format!("variant {}", variant.name))?;
        Ok((variant.name.clone(), config))
    };
    plan.variants.iter().map(of).collect()
}

/// What the command line describes, on top of the preset of the experiments.
fn on_preset(run: &RunArgs) -> RunArgs {
    let config = run.config.clone().or_else(|| Some(PathBuf::from(PRESET)));
    RunArgs { config, threads: None, ..run.clone() }
}

/// One experiment on one data set.
struct Run<'a> {
    name: &'a str,
    plan: &'a Plan,
    variants: &'a [(String, PipelineConfig)],
    selected: &'a Selected,
    output: &'a Path,
}

impl Run<'_> {
    /// Runs all pairs, writes the files, and returns the counts and the tables.
    fn all(&self) -> Result<(Tally, String)> {
        let Run { name, plan, output, .. } = self;
        let bar = Bar::new(self.selected.pairs.len() as u64);
        let mut tally = Tally::default();
        let mut left_out = Vec::new();
        let mut rows = csv_line([
            "source",
            "target",
            "variant",
            "nuisance",
            "estimator",
            "iterations",
            "metric",
            "threshold_pr",
            "rmse_pr",
            "matches",
            "inliers",
        ]) + "\n";
        for (done, pair) in (1..).zip(&self.selected.pairs) {
            match self.one(pair) {
                Ok(measured) => {
                    for m in &measured {
                        let c = &m.cell;
                        rows += &(csv_line([
                            pair.source.clone(),
                            pair.target.clone(),
                            c.variant.clone(),
                            c.nuisance.clone(),
                            c.estimator.to_owned(),
                            c.iterations.to_string(),
                            c.metric.to_owned(),
                            c.threshold_pr.to_string(),
                            m.rmse_pr.map_or(String::new(), |v| format!("{v:.4}")),
                            m.share.matches.to_string(),
                            m.share.inliers.to_string(),
                        ]) + "\n");
                    }
                    tally.add(measured);
                }
                Err(error) => left_out.push(format!("{} to {}: {error:#}", pair.source, pair.target)),
            }
            bar.at(done, name);
        }
        drop(bar);
        let mut text = tally.markdown(plan, &self.selected.name);
        if !left_out.is_empty() {
            text += &format!("\n## Pairs left out\n\n* {}\n", left_out.join("\n* "));
        }
        write_file(&output.join(format!("{name}.csv")), tally.csv(plan).as_bytes())?;
        write_file(&output.join(format!("{name}-pairs.csv")), rows.as_bytes())?;
        write_file(&output.join(format!("{name}.md")), text.as_bytes())?;
        Ok((tally, text))
    }

    fn one(&self, pair: &TruePair) -> Result<Vec<congruent_evaluation::experiment::Measured>> {
        let files = Pair { source: &pair.source_file, target: &pair.target_file };
        let scans = files.map(|file| read_scan(file)).both()?;
        Ok(run_pair(self.plan, self.variants, scans.as_ref(), &pair.target_from_source)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_can_be_read_and_its_variants_exist() {
        for (name, plan) in plans("all").unwrap() {
            let variants = variants(&plan, &RunArgs::default()).unwrap_or_else(|error| panic!("{name}: {error:#}"));
            assert_eq!(variants.len(), plan.variants.len());
            assert!(!plan.metrics.is_empty() && !plan.notes.is_empty(), "{name}");
        }
        assert!(plans("nothing").unwrap_err().to_string().contains("there are: iterations, "));
    }
}
