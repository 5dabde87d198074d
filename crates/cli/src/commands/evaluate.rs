//! `congruent evaluate`: registers every pair of a data set and scores the result.

use super::dataset::{Selected, files_of, names_of, select};
use super::pages::write_pages;
use super::{Loaded, load, show};
use crate::args::EvaluateArgs;
use crate::evaluation_rows::EvaluationRows;
use crate::fingerprint::fingerprint;
use crate::progress::Bar;
use crate::{configuration, output, outputs};
use anyhow::{Context, Result, bail};
use congruent_evaluation::experiment::Nuisance;
use congruent_evaluation::{GroundTruth, PairRow, Status, Summary, mcnemar_of};
use congruent_geometry::{Scan, ScanError};
use congruent_io::TruePair;
use congruent_pipeline::{Pair, PipelineConfig, Prior, register_traced};
use congruent_report::{evaluation_figures, evaluation_page};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// The bound for the accuracy in the progress display, `pr`.
const RUNNING_D_RMSE: f64 = 2.5;
/// The configuration of the last run; its first line has this prefix and names the rows that belong to it.
const CONFIG: &str = "config.toml";
const ROWS_ARE: &str = "# configuration of rows: ";
const SUMMARY: &str = "summary.txt";
/// Exit code if some pairs had a file or a ground truth that could not be used.
const SOME_ERRORS: u8 = 1;

pub(super) fn run(args: &EvaluateArgs) -> Result<ExitCode> {
    match (&args.show, &args.output) {
        (Some(pair), _) => show::run(args, pair),
        (None, Some(directory)) => run_into(args, directory),
        (None, None) => bail!("give a directory for the results with -o, or a pair with --show"),
    }
}

fn run_into(args: &EvaluateArgs, directory: &Path) -> Result<ExitCode> {
    let config = configuration::resolve(&args.run)?;
    let text = toml::to_string(&config)?;
    let spoil = &args.spoil;
    let spoilt = spoil.iter().map(|nuisance| format!("spoilt: {nuisance}\n")).collect::<String>();
    let configuration = match spoil.as_slice() {
        [] => fingerprint(&[env!("CARGO_PKG_VERSION"), &text]),
        _ => fingerprint(&[env!("CARGO_PKG_VERSION"), &text, &spoilt]),
    };
    let selected = select(&args.dataset)?;
    let other = args.compare.as_deref().map(latest).transpose()?;
    outputs::create_folder(directory)?;
    let mut results = EvaluationRows::files(directory).to_vec();
    results.extend([CONFIG, SUMMARY].map(|name| directory.join(name)));
    args.page.check(&files_of(&selected), &results)?;
    let mut rows = EvaluationRows::open(directory, &configuration)?;
    let config_file = directory.join(CONFIG);
    congruent_io::write_file(&config_file, format!("{ROWS_ARE}{configuration}\n{text}").as_bytes())?;
    evaluate(Trial { config: &config, spoil }, &configuration, &selected, &mut rows)?;
    rows.write_table(directory)?;

    let ours = |set: &Selected| -> Vec<PairRow> {
        let wanted: Vec<String> = set.pairs.iter().map(|pair| name_of(&set.name, pair)).collect();
        let is_ours = |row: &&PairRow| row.configuration == configuration && wanted.contains(&row.pair);
        rows.all().iter().filter(is_ours).cloned().collect()
    };
    let mut summary = spoilt;
    if selected.len() > 1 {
        selected.iter().for_each(|set| summary += &format!("{}: {}\n", set.name, Summary::new(&ours(set))));
        summary += "all: ";
    }
    let ours: Vec<PairRow> = selected.iter().flat_map(&ours).collect();
    summary += &Summary::new(&ours).to_string();
    if let (Some(other), Some(earlier)) = (other, &args.compare) {
        summary += &format!("\nagainst {}: {}", earlier.display(), mcnemar_of(&ours, &other));
    }
    congruent_io::write_file(&directory.join(SUMMARY), summary.as_bytes())?;
    output::data(summary.trim_end())?;
    let version = env!("CARGO_PKG_VERSION");
    write_pages(
        &args.page,
        || evaluation_page(&names_of(&selected), &ours, &summary, &text, version),
        || evaluation_figures(&ours),
    )?;
    let complete = selected.iter().all(Selected::is_whole) && ours.iter().all(|row| row.status != Status::Error);
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::from(SOME_ERRORS) })
}

/// How pairs are registered, and how their scans are spoilt before that.
#[derive(Clone, Copy)]
struct Trial<'a> {
    config: &'a PipelineConfig,
    spoil: &'a [Nuisance],
}

/// Adds the rows that are missing.
fn evaluate(trial: Trial<'_>, configuration: &str, selected: &[Selected], rows: &mut EvaluationRows) -> Result<()> {
    let all: Vec<(&str, &TruePair)> =
        selected.iter().flat_map(|set| set.pairs.iter().map(|pair| (set.name.as_str(), pair))).collect();
    let bar = Bar::new(all.len() as u64);
    let (mut right, mut scored, mut skipped) = (0, 0, 0);
    for (done, (dataset, pair)) in (1..).zip(all) {
        let name = name_of(dataset, pair);
        let row = match rows.find(configuration, &name) {
            Some(row) => {
                skipped += 1;
                row.clone()
            }
            None => {
                let row = judged(dataset, pair, trial);
                let row = PairRow { configuration: configuration.to_owned(), pair: name, ..row };
                rows.add(row.clone())?;
                row
            }
        };
        if row.status == Status::Scored {
            scored += 1;
            right += usize::from(row.is_right(RUNNING_D_RMSE));
        }
        bar.at(done, &format!("{right}/{scored} right at {RUNNING_D_RMSE} pr"));
    }
    drop(bar);
    if skipped > 0 {
        output::remark(&format!("{skipped} pairs had already been evaluated"));
    }
    Ok(())
}

/// Registers one pair and scores the result. A pair with a file that cannot be used gets a row, too.
fn judged(dataset: &str, pair: &TruePair, Trial { config, spoil }: Trial<'_>) -> PairRow {
    let row = |overlap: f64| PairRow::new(dataset, &pair.source, &pair.target, overlap);
    let files = Pair { source: &pair.source_file, target: &pair.target_file };
    let loaded = match files.par_map(|file| load(file)).both().with_context(|| format!("named at {}", pair.place)) {
        Ok(scans) => scans,
        Err(error) => return row(pair.overlap.unwrap_or(0.0)).with_error(format!("{error:#}")),
    };
    let truth = GroundTruth::of_scans(loaded.as_ref().map(|loaded| &loaded.scan), &pair.target_from_source);
    let overlap = pair.overlap.unwrap_or_else(|| truth.overlap());
    let scans = match spoilt(loaded, spoil, truth.resolution(), config.seed) {
        Ok(scans) => scans,
        Err(error) => return row(overlap).with_error(format!("after --spoil: {error:#}")),
    };
    let truth = if spoil.is_empty() { truth } else { truth.recentred(scans.as_ref().map(|scan| *scan.origin())) };
    let start = Instant::now();
    let (registration, trace) = register_traced(scans.as_ref(), &Prior::default(), config, &|_| ());
    let seconds = start.elapsed().as_secs_f64();
    row(overlap).judged(&truth, &registration, &trace, seconds)
}

/// Returns the scans after all nuisances, with separate random draws for each scan; `pr` in data units.
fn spoilt(loaded: Pair<Loaded>, spoil: &[Nuisance], pr: f64, seed: u64) -> Result<Pair<Scan>, ScanError> {
    if spoil.is_empty() {
        return Ok(loaded.map(|loaded| loaded.scan));
    }
    let streams = Pair { source: seed.wrapping_mul(2), target: seed.wrapping_mul(2).wrapping_add(1) };
    let spoil = |(loaded, seed): (Loaded, u64)| {
        // Each nuisance has its own random draws, even if the same one is given twice.
        let seeds = (0..).map(|place: u64| seed.wrapping_add(place << 32));
        let spoilt = spoil.iter().zip(seeds).fold(loaded.raw, |scan, (nuisance, seed)| nuisance.apply(&scan, pr, seed));
        Scan::new(&spoilt)
    };
    loaded.zip(streams).par_map(spoil).both()
}

/// Returns a fingerprint that distinguishes a pair from all others: of its names and its ground truth.
fn name_of(dataset: &str, pair: &TruePair) -> String {
    let truth = format!("{:?}", congruent_geometry::to_rows(&pair.target_from_source));
    fingerprint(&[dataset, &pair.source, &pair.target, &truth])
}

/// Returns the rows of the configuration that was evaluated last into a directory. The configuration file there says
/// which one it was, because a run that finds all its rows adds none.
fn latest(directory: &Path) -> Result<Vec<PairRow>> {
    let rows = EvaluationRows::read(directory)?;
    let text = std::fs::read_to_string(directory.join(CONFIG)).unwrap_or_default();
    let named = text.lines().next().and_then(|line| line.strip_prefix(ROWS_ARE)).map(str::to_owned);
    let last = named.or_else(|| rows.last().map(|row| row.configuration.clone()));
    Ok(rows.into_iter().filter(|row| Some(&row.configuration) == last.as_ref()).collect())
}
