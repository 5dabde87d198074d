//! `congruent experiment`: the tables and figures of the paper on data sets.

use super::dataset::{Selected, files_of, names_of, select};
use super::pages::write_pages;
use crate::args::{ExperimentArgs, RunArgs};
use crate::progress::Bar;
use crate::{configuration, output, outputs};
use anyhow::{Context, Result, anyhow, bail};
use congruent_evaluation::experiment::claims::{Counts, claims, claims_table};
use congruent_evaluation::experiment::{Measured, Plan, Request, SETTINGS_READ, Shows, Tally, Variant, run_pair};
use congruent_io::{TruePair, csv_line, read_scan, write_file};
use congruent_pipeline::{Pair, PipelineConfig};
use congruent_report::{ExperimentReport, experiment_figures, experiment_page};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The experiments, as written in `configs/experiments/`.
pub(crate) const PLANS: [(&str, &str); 10] = [
    ("inliers", include_str!("../../../../configs/experiments/inliers.toml")),
    ("iterations", include_str!("../../../../configs/experiments/iterations.toml")),
    ("estimators", include_str!("../../../../configs/experiments/estimators.toml")),
    ("thresholds", include_str!("../../../../configs/experiments/thresholds.toml")),
    ("threshold-rmse", include_str!("../../../../configs/experiments/threshold-rmse.toml")),
    ("threshold-iterations", include_str!("../../../../configs/experiments/threshold-iterations.toml")),
    ("metrics", include_str!("../../../../configs/experiments/metrics.toml")),
    ("nuisances", include_str!("../../../../configs/experiments/nuisances.toml")),
    ("variants", include_str!("../../../../configs/experiments/variants.toml")),
    ("time", include_str!("../../../../configs/experiments/time.toml")),
];
/// The preset on which the experiments are based, unless another one is named.
const PRESET: &str = "paper";
/// Which of the paper's claims hold.
const CLAIMS: &str = "claims.md";
/// Exit code if some pairs or some lines of the ground truth could not be used.
const SOME_ERRORS: u8 = 1;

pub(super) fn run(args: &ExperimentArgs) -> Result<ExitCode> {
    let mut experiments = Vec::new();
    for (name, plan) in plans(&args.experiment)? {
        let variants = variants(&plan, &args.run)?;
        experiments.push(Experiment::new(name, plan, variants));
    }
    let selected = select(&args.dataset)?;
    outputs::create_folder(&args.output)?;
    let plan_file = Path::new(&args.experiment);
    let results: Vec<PathBuf> =
        experiments.iter().flat_map(|e| e.files(&args.output)).chain([args.output.join(CLAIMS)]).collect();
    args.page.check(&[files_of(&selected), vec![plan_file]].concat(), &results)?;
    measure(&mut experiments, &selected);
    let mut texts = Vec::new();
    for experiment in &experiments {
        texts.push(experiment.write(&args.output)?);
    }
    texts.extend(write_claims(&experiments, &args.output)?);
    output::data(texts.join("\n").trim_end())?;
    write_page(args, &experiments, &texts, &selected)?;
    let complete = selected.iter().all(Selected::is_whole) && experiments.iter().all(|e| e.left_out.is_empty());
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::from(SOME_ERRORS) })
}

/// Returns all experiments, the one of this name, or one from a file.
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
            anyhow!("{wanted}: is not an experiment, and cannot be read ({error}); there are: {names}, all")
        })?;
        let stem = path.file_stem().map_or("experiment".into(), |stem| stem.to_string_lossy().into_owned());
        plans.push((stem, parse(&text, wanted)?));
    }
    Ok(plans)
}

fn parse(text: &str, name: &str) -> Result<Plan> {
    let plan: Plan = toml::from_str(text).map_err(|error| anyhow!("{name}: {}", error.to_string().trim()))?;
    match plan.contradiction() {
        Some(contradiction) => bail!("{name}: {contradiction}"),
        None => Ok(plan),
    }
}

/// Applies the changes of the plan to what the command line describes.
fn variants(plan: &Plan, run: &RunArgs) -> Result<Vec<(String, PipelineConfig)>> {
    let of = |variant: &Variant| {
        let set: Vec<String> = run.set.iter().chain(&variant.set).cloned().collect();
        set.iter().try_for_each(|set| refuse_without_effect(set))?;
        let all = RunArgs { set, ..on_preset(run) };
        let config = configuration::resolve(&all).with_context(|| format!("variant {}", variant.name))?;
        Ok((variant.name.clone(), config))
    };
    plan.variants.iter().map(of).collect()
}

/// Refuses a change to a setting that experiments do not read. Names that are not settings are left to the reader of the
/// configuration, which suggests others.
fn refuse_without_effect(set: &str) -> Result<()> {
    let name = set.split(['.', '=']).next().unwrap_or_default().trim();
    if matches!(name, "metric" | "estimator") {
        bail!("`{set}` has no effect: the plan lists the metrics and estimators; write a plan of your own");
    }
    if settings(&PipelineConfig::default())?.contains_key(name) && !SETTINGS_READ.contains(&name) {
        bail!(
            "`{set}` has no effect: an experiment takes the best hypothesis as it was drawn, and reads only {}; leave it \
             out, or use `congruent evaluate`, which runs the whole pipeline",
            SETTINGS_READ.join(", ")
        );
    }
    Ok(())
}

/// Returns the part of a configuration that experiments read, as TOML.
fn what_is_read(config: &PipelineConfig) -> Result<String> {
    let mut settings = settings(config)?;
    let each = SETTINGS_READ.iter().filter_map(|name| settings.remove_entry(*name));
    let texts: Vec<String> =
        each.map(|one| toml::to_string(&toml::Table::from_iter([one]))).collect::<Result<_, _>>()?;
    Ok(texts.join("\n"))
}

fn settings(config: &PipelineConfig) -> Result<toml::Table> {
    toml::Table::try_from(config).context("the configuration cannot be written as TOML")
}

/// One experiment and what it has measured so far.
struct Experiment {
    name: String,
    plan: Plan,
    variants: Vec<(String, PipelineConfig)>,
    tally: Tally,
    rows: String,
    left_out: Vec<String>,
}

/// All measurements on one pair, or why there are none.
type Outcome = Result<Vec<Vec<Measured>>>;

/// Runs all experiments on all pairs: several pairs at a time, except where time is measured.
fn measure(experiments: &mut [Experiment], selected: &[Selected]) {
    let (mut clocked, mut rest): (Vec<_>, Vec<_>) =
        experiments.iter_mut().partition(|experiment| experiment.plan.shows == Shows::Time);
    let side_by_side = 2 * rayon::current_num_threads();
    for (group, at_once) in [(&mut rest, side_by_side), (&mut clocked, 1)] {
        if group.is_empty() {
            continue;
        }
        let bar = Bar::new(selected.iter().map(|set| set.pairs.len() as u64).sum());
        let mut done = 0;
        for set in selected {
            for pairs in set.pairs.chunks(at_once) {
                let outcomes: Vec<Outcome> = pairs.par_iter().map(|pair| measured(group, pair)).collect();
                for (pair, outcome) in pairs.iter().zip(outcomes) {
                    add(group, &set.name, pair, outcome);
                }
                done += pairs.len() as u64;
                bar.at(done, &set.name);
            }
        }
    }
}

fn measured(experiments: &[&mut Experiment], pair: &TruePair) -> Outcome {
    let files = Pair { source: &pair.source_file, target: &pair.target_file };
    let scans = files.par_map(|file| read_scan(file)).both().with_context(|| format!("named at {}", pair.place))?;
    let requests: Vec<Request<'_>> =
        experiments.iter().map(|e| Request { plan: &e.plan, variants: &e.variants }).collect();
    Ok(run_pair(&requests, scans.as_ref(), &pair.target_from_source)?)
}

fn add(experiments: &mut [&mut Experiment], dataset: &str, pair: &TruePair, outcome: Outcome) {
    match outcome {
        Ok(results) => {
            for (experiment, measured) in experiments.iter_mut().zip(results) {
                experiment.add(dataset, pair, measured);
            }
        }
        Err(error) => {
            let why = format!("{dataset}: {} to {}: {error:#}", pair.source, pair.target);
            experiments.iter_mut().for_each(|experiment| experiment.left_out.push(why.clone()));
        }
    }
}

impl Experiment {
    fn new(name: String, plan: Plan, variants: Vec<(String, PipelineConfig)>) -> Experiment {
        let rows = csv_line(Measured::COLUMNS) + "\n";
        Experiment { name, plan, variants, tally: Tally::default(), rows, left_out: Vec::new() }
    }

    fn add(&mut self, dataset: &str, pair: &TruePair, measured: Vec<Measured>) {
        for one in &measured {
            self.rows += &one.csv([dataset, &pair.source, &pair.target]);
            self.rows.push('\n');
        }
        self.tally.add(dataset, measured);
    }

    /// Returns where it writes the counts, the rows of pairs, and the tables to be read.
    fn files(&self, output: &Path) -> [PathBuf; 3] {
        [".csv", "-pairs.csv", ".md"].map(|ending| output.join(format!("{}{ending}", self.name)))
    }

    /// Writes the files and returns the tables.
    fn write(&self, output: &Path) -> Result<String> {
        let mut text = self.tally.markdown(&self.plan);
        if !self.left_out.is_empty() {
            text += &format!("\n## Pairs left out\n\n* {}\n", self.left_out.join("\n* "));
        }
        let [table, pairs, tables] = self.files(output);
        write_file(&table, self.tally.csv(&self.plan).as_bytes())?;
        write_file(&pairs, self.rows.as_bytes())?;
        write_file(&tables, text.as_bytes())?;
        Ok(text)
    }
}

/// Writes the page and the figures that were asked for; texts beyond those of the experiments go to the end.
fn write_page(
    args: &ExperimentArgs,
    experiments: &[Experiment],
    texts: &[String],
    selected: &[Selected],
) -> Result<()> {
    let reports: Vec<ExperimentReport<'_>> = experiments
        .iter()
        .zip(texts)
        .map(|(e, text)| ExperimentReport { name: &e.name, plan: &e.plan, tally: &e.tally, text })
        .collect();
    let config = what_is_read(&configuration::resolve(&on_preset(&args.run))?)?;
    let more = texts.get(experiments.len()).map_or("", String::as_str);
    write_pages(
        &args.page,
        || experiment_page(&names_of(selected), &reports, more, &config, env!("CARGO_PKG_VERSION")),
        || reports.iter().flat_map(experiment_figures).collect(),
    )
}

/// Returns what the command line describes, on top of the preset of the experiments.
fn on_preset(run: &RunArgs) -> RunArgs {
    let config = run.config.clone().or_else(|| Some(PathBuf::from(PRESET)));
    RunArgs { config, threads: None, ..run.clone() }
}

/// Writes which of the paper's claims about these experiments hold, if there are any.
fn write_claims(experiments: &[Experiment], output: &Path) -> Result<Option<String>> {
    let counts: Vec<_> = experiments.iter().map(|e| (e.name.clone(), e.tally.counts(&e.plan))).collect();
    let claims = claims(&Counts { experiments: &counts });
    if claims.is_empty() {
        return Ok(None);
    }
    let text = claims_table(&claims);
    write_file(&output.join(CLAIMS), text.as_bytes())?;
    Ok(Some(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_can_be_read_and_its_variants_exist() {
        for (name, plan) in plans("all").unwrap() {
            let variants = variants(&plan, &RunArgs::default()).unwrap_or_else(|error| panic!("{name}: {error:#}"));
            assert_eq!(variants.len(), plan.variants.len());
            let ranks = !plan.metrics.is_empty() || plan.shows == Shows::Inliers;
            assert!(ranks && !plan.notes.is_empty(), "{name}");
        }
        assert!(plans("nothing").unwrap_err().to_string().contains("there are: inliers, iterations, "));
    }

    #[test]
    fn settings_that_are_not_read_are_refused_and_not_printed() {
        let plan = parse("title = ''", "mine").unwrap();
        let set = |set: &str| variants(&plan, &RunArgs { set: vec![set.to_owned()], ..RunArgs::default() });
        for (assignment, expected) in [
            ("refinement=point-to-plane", "reads only seed, sampling, normals, "),
            ("pool.poses=50", "leave it out, or use `congruent evaluate`"),
            ("ranking=none", "has no effect"),
            ("quick=[]", "has no effect"),
            ("metric.mse.threshold=5pr", "the plan lists the metrics"),
            ("estimator = ransac", "the plan lists the metrics"),
            ("pol.poses=50", "did you mean `pool`?"),
        ] {
            let message = format!("{:#}", set(assignment).unwrap_err());
            assert!(message.contains(expected) && message.contains(assignment), "{assignment} gave {message}");
        }
        for assignment in ["seed=3", "matcher.ratio.keep=0.1", "frame=shot", "normals.source=given"] {
            assert!(set(assignment).is_ok(), "{assignment}");
        }
        let text = what_is_read(&set("seed=3").unwrap()[0].1).unwrap();
        assert!(text.starts_with("seed = 3\n") && text.contains("[matcher.ratio]\nkeep = 0.3\n"), "{text}");
        assert!(["metric", "pool", "refinement"].iter().all(|name| !text.contains(&format!("[{name}"))), "{text}");
        assert!(congruent_settings::parse(&text, "page").is_ok(), "{text}");
    }

    #[test]
    fn what_cannot_be_measured_is_refused() {
        for (text, expected) in [
            ("baseline = \"INLIERS\"\nmetrics = [{ mse = {} }]", "`INLIERS` is not one of its metrics: MSE"),
            ("thresholds-pr = [7.5, -7.5]", "-7.5 is out of range"),
            ("d-rmse = [nan]", "NaN is out of range"),
        ] {
            let text = format!("title = \"\"\n{text}");
            let message = parse(&text, "mine").map(|_| ()).unwrap_err().to_string();
            assert!(message.starts_with("mine: ") && message.contains(expected), "{message}");
        }
    }
}
