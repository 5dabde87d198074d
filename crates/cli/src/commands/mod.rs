//! One file per command.

mod align;
mod config;
mod convert;
mod dataset;
mod demo;
mod describe;
mod estimate;
mod evaluate;
mod experiment;
mod inspect;
mod keypoints;
mod matching;
mod pages;
mod reconstruct;
mod refine;
mod show;
mod simulate;
mod stages;

pub(crate) use dataset::{listed_pairs, named_once};

use crate::args::{Args, Command, ReadingArgs};
use crate::{batch, calibration, output};
use anyhow::{Context, Result};
use congruent_geometry::{RawScan, Scan, samples_of_coarse_mesh};
use std::path::Path;
use std::process::ExitCode;

/// Runs the command on the threads that it may use; errors are bad input or configuration.
pub(crate) fn run(args: Args) -> Result<ExitCode> {
    on_threads(args.command.threads(), || dispatched(args.command))?
}

fn dispatched(command: Command) -> Result<ExitCode> {
    match command {
        Command::Align(args) => align::run(&args),
        Command::Refine(args) => refine::run(&args),
        Command::Batch(args) => batch::run(&args),
        Command::Merge(args) => batch::merge(&args),
        Command::Reconstruct(args) => reconstruct::run(&args),
        Command::Keypoints(args) => keypoints::run(&args),
        Command::Describe(args) => describe::run(&args),
        Command::Match(args) => matching::run(&args),
        Command::Estimate(args) => estimate::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Experiment(args) => experiment::run(&args),
        Command::Calibrate(args) => calibration::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Config(command) => config::run(&command),
        Command::Demo(args) => demo::run(&args),
    }
}

/// A scan as its file has it, and cleaned.
pub(crate) struct Loaded {
    raw: RawScan,
    pub(crate) scan: Scan,
}

/// How a scan file is read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reading {
    /// Position of the scanner, file coordinates; takes precedence over that in the file.
    pub(crate) viewpoint: Option<[f64; 3]>,
    /// Side of the cells of which one point each is kept, file units; all points if it is not given.
    pub(crate) thin: Option<f64>,
}

impl Reading {
    pub(crate) fn new(args: ReadingArgs) -> Reading {
        Reading { thin: args.thin, ..Reading::default() }
    }

    /// Reads what is to be kept of a file.
    pub(crate) fn raw(&self, path: &Path) -> Result<RawScan> {
        let raw = match self.thin {
            None => congruent_io::read_scan(path)?,
            Some(leaf) => congruent_io::read_scan_thinned(path, leaf)?,
        };
        Ok(RawScan { viewpoint: self.viewpoint.or(raw.viewpoint), ..raw })
    }
}

/// Loads a scan as its file has it.
pub(crate) fn load(path: &Path) -> Result<Loaded> {
    load_as(path, Reading::default())
}

/// Loads a scan, read as the user wants it; samples it if it is a mesh of large triangles.
pub(crate) fn load_as(path: &Path, reading: Reading) -> Result<Loaded> {
    let raw = reading.raw(path)?;
    let samples = samples_of_coarse_mesh(&raw);
    let scan = Scan::new(samples.as_ref().unwrap_or(&raw)).with_context(|| path.display().to_string())?;
    if samples.is_some() {
        let (name, sampled) = (path.display(), scan.points().len());
        output::remark(&format!(
            "{name}: a mesh of large triangles; {sampled} points on them are used in place of its {} vertices",
            raw.points.len()
        ));
    }
    Ok(Loaded { raw, scan })
}

/// Loads the vertices of a mesh, however large its triangles are.
pub(crate) fn load_vertices(path: &Path) -> Result<Loaded> {
    let raw = congruent_io::read_scan(path)?;
    let scan = Scan::new(&raw).with_context(|| path.display().to_string())?;
    Ok(Loaded { raw, scan })
}

/// Does work on this number of threads, or on all processors.
pub(crate) fn on_threads<T: Send>(threads: Option<u16>, work: impl FnOnce() -> T + Send) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .build()
        .context("threads cannot be started")?;
    Ok(pool.install(work))
}
