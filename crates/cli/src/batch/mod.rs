//! Many pairs, one row each: `congruent batch` and `congruent merge`.
//!
//! The scans are measured, which determines the lengths of the collection; the pairs are chosen; each pair is
//! registered on its own, with its own seed. Therefore neither the order, nor the number of threads, nor a division
//! into shards can change a row. Only the times differ.

mod board;
mod cache;
mod columns;
mod crew;
mod input;
mod merge;
mod pairs;
#[cfg(feature = "parquet")]
mod parquet;
mod results;
mod row;
mod run;
mod survey;
mod table;
mod work;

pub(crate) use merge::merge;
pub(crate) use work::Share;

use crate::args::BatchArgs;
use crate::commands::Reading;
use crate::fingerprint::fnv;
use crate::layers::{self, Sources};
use crate::output;
use anyhow::{Result, bail};
pub(crate) use cache::Cache;
use congruent_pipeline::PipelineConfig;
use crew::Crew;
pub(crate) use input::Input;
use input::Wanted;
use pairs::Job;
use results::Results;
pub(crate) use row::Row;
use run::Run;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
pub(crate) use survey::Survey;
use work::{PanicSilence, Work};

/// Exit code if some pair ended with an error or was given up, or could not be taken from the input.
const SOME_FAILED: u8 = 1;
/// The exit code that shells expect of a program that was stopped by Ctrl-C.
const INTERRUPTED: u8 = 130;
/// Fraction of the memory budget for descriptors; the rest is for the running pairs.
const CACHE_SHARE: f64 = 0.5;
/// Number of similar scans with which `--pairs auto` pairs each scan.
const NEIGHBORS: u32 = 8;

pub(crate) fn run(args: &BatchArgs) -> Result<ExitCode> {
    let input = Input::find(&args.input, args.wanted(), args.data.as_deref())?;
    run_then(args, input, &|ended| {
        let is_whole = ended.errors == 0 && ended.input.broken == 0;
        Ok(if is_whole { ExitCode::SUCCESS } else { ExitCode::from(SOME_FAILED) })
    })
}

/// All pairs of a run that was not interrupted, and what was computed for them.
pub(crate) struct Ended<'a> {
    pub(crate) input: &'a Input,
    pub(crate) survey: &'a Survey,
    pub(crate) cache: &'a Cache,
    /// Sorted by id.
    pub(crate) rows: Vec<Row>,
    /// Number of rows without a verdict.
    pub(crate) errors: usize,
}

/// Registers the pairs of the input and calls `then` with them; its exit code is returned.
pub(crate) fn run_then(
    args: &BatchArgs,
    found: Input,
    then: &dyn Fn(&Ended<'_>) -> Result<ExitCode>,
) -> Result<ExitCode> {
    let input = Input { reading: Reading::new(args.reading), ..found };
    if args.neighbors.is_some() && !matches!(input.wanted, Wanted::Auto) {
        bail!("--neighbors needs --pairs auto; add that, or omit --neighbors");
    }
    input.remarks.iter().for_each(|remark| output::remark(&format!("warning: {remark}")));
    let config = layers::resolve(&Sources::of_run(&args.run, Some(&input.folder)))?.config;
    let interrupted = on_interrupt()?;
    batch(args, &input, &config, &interrupted, then)
}

fn batch(
    args: &BatchArgs,
    input: &Input,
    config: &PipelineConfig,
    interrupted: &AtomicBool,
    then: &dyn Fn(&Ended<'_>) -> Result<ExitCode>,
) -> Result<ExitCode> {
    let kept = (CACHE_SHARE * args.memory as f64) as u64;
    let cache = Cache::new(usize::try_from(kept).unwrap_or(usize::MAX));
    let threads = rayon::current_num_threads();
    let crew = Crew { threads, memory: args.memory - kept, stop: interrupted };
    // A panic is reported in the row of its pair or scan.
    let silence = PanicSilence::begin();
    let Some(survey) = Survey::of(input, config, &crew)? else { return Ok(stopped()) };
    // A scan that was repaired since the first run would change the lengths, and with them all rows.
    let survey = match Run::read(&args.output) {
        Ok(before) if args.resume => survey.with_lengths(&before.lengths),
        _ => survey,
    };
    let neighbors = args.neighbors.unwrap_or(NEIGHBORS) as usize;
    let Some(jobs) = chosen(input, &survey, &cache, &crew, neighbors)? else { return Ok(stopped()) };
    let run = Run::new(config, input, &survey, &jobs, args.shard);
    let mine: Vec<Job> = args.shard.of(jobs);
    let wanted = mine.iter().map(|job| job.fingerprint(input.names(job))).collect();
    let results = Results::open(&args.output, run, &wanted, config, args.resume)?;
    if results.dropped > 0 {
        output::remark(&format!("{} earlier rows are not of the pairs wanted now and are dropped", results.dropped));
    }
    let missing: Vec<Job> = mine.into_iter().filter(|job| !results.has(&job.id)).collect();

    let work = Work { input, survey: &survey, cache: &cache, config, time_limit: args.time_limit };
    work.run(missing, &results, &crew)?;
    drop(silence);
    let summary = results.finish(&args.output)?;
    output::remark(&summary.text(&args.output));
    if interrupted.load(Ordering::Relaxed) {
        return Ok(stopped());
    }
    let rows = results::all_rows(&args.output)?;
    then(&Ended { input, survey: &survey, cache: &cache, rows, errors: summary.errors })
}

fn stopped() -> ExitCode {
    output::remark("stopped; to continue, run the same command with --resume");
    ExitCode::from(INTERRUPTED)
}

/// Returns all pairs of the run, sorted by id; `None` if it was stopped.
fn chosen(
    input: &Input,
    survey: &Survey,
    cache: &Cache,
    crew: &Crew<'_>,
    neighbors: usize,
) -> Result<Option<Vec<Job>>> {
    let jobs = match &input.wanted {
        Wanted::Listed(jobs) => jobs.clone(),
        Wanted::All => pairs::all(&input.scans),
        Wanted::Sequential => pairs::sequential(&input.scans),
        Wanted::Auto => match survey.signatures(input, cache, crew)? {
            Some(signatures) => pairs::alike(&input.scans, &signatures, neighbors),
            None => return Ok(None),
        },
    };
    pairs::sorted(jobs).map(Some)
}

/// Returns a flag that the first Ctrl-C sets (or the signal by which job schedulers end a program); the second one ends
/// the program at once.
fn on_interrupt() -> Result<Arc<AtomicBool>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        output::remark("stopping after the running pairs; press Ctrl-C again to stop at once");
    })?;
    Ok(interrupted)
}

/// Returns a short name for a configuration: FNV-1a over all its settings.
pub(crate) fn hash_of(config: &PipelineConfig) -> String {
    let text = toml::to_string(config).expect("a configuration can be written as TOML");
    format!("{:016x}", fnv(text.as_bytes()))
}
