//! `congruent align`: two scans in, one pose out.

use super::convert::warn_of_losses;
use super::stages::{save, saved_files};
use super::{Loaded, Reading, load_as};
use crate::args::{AlignArgs, ReadingArgs, ResultArgs, RunArgs, ViewpointArgs};
use crate::guess::prior;
use crate::progress::Progress;
use crate::result::Report;
use crate::{configuration, output, outputs};
use anyhow::{Result, bail};
use congruent_geometry::{Orientation, RawScan, RigidTransform, Scan};
use congruent_io::{check_scan_name, write_file, write_pose, write_scan};
use congruent_pipeline::{Outcome, Pair, PipelineConfig, Prior, Registration, Stage, Trace, Verdict, register_traced};
use congruent_report::{PairReport, pair_page};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Exit code if the verdict is `failed` or `ambiguous`.
pub(super) const NOT_REGISTERED: u8 = 1;

pub(super) fn run(args: &AlignArgs) -> Result<ExitCode> {
    let prior = prior(&args.prior)?;
    let files = Pair { source: args.source.as_path(), target: args.target.as_path() };
    let stages = args.save_stages.as_deref();
    stages.map_or(Ok(()), outputs::create_folder)?;
    let saved = stages.map_or(Ok(Vec::new()), saved_files)?;
    let inputs: Vec<&Path> = [files.source, files.target].into_iter().chain(args.prior.init.as_deref()).collect();
    args.output.check(&inputs, &saved)?;
    let registering: Registering<'_> = &|scans, config, observe| register_traced(scans, &prior, config, observe);
    let mut aligned = align(
        files,
        readings(&args.viewpoints, args.reading),
        &args.run,
        RawSource::wanted(&args.output),
        registering,
    )?;
    let code = aligned.put(files, &args.output)?;
    if let Some(directory) = stages {
        let trace = std::mem::take(&mut aligned.trace);
        save(directory, trace, aligned.scans.as_ref())?;
    }
    Ok(code)
}

/// How the two files are read.
pub(super) fn readings(viewpoints: &ViewpointArgs, reading: ReadingArgs) -> Pair<Reading> {
    let seen_from =
        |place: Option<[f64; 3]>| Reading { viewpoint: place.or(viewpoints.viewpoint), ..Reading::new(reading) };
    Pair { source: seen_from(viewpoints.source_viewpoint), target: seen_from(viewpoints.target_viewpoint) }
}

/// Two registered scans.
pub(super) struct Aligned {
    pub(super) scans: Pair<Scan>,
    /// The source with all that its file holds, if that was asked for.
    raw_source: Option<RawScan>,
    pub(super) registration: Registration,
    pub(super) trace: Trace,
    pub(super) config: PipelineConfig,
    pub(super) report: Report,
}

/// What to do with the source as its file has it, which takes several times the memory of the cleaned scan.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum RawSource {
    /// It is kept, so that it can be written as aligned.
    Kept,
    /// It is dropped as soon as it has been cleaned.
    Dropped,
}

impl ResultArgs {
    /// Refuses output files that cannot be written as requested. `more` are the other files that the command writes.
    pub(super) fn check(&self, inputs: &[&Path], more: &[PathBuf]) -> Result<()> {
        if let Some(path) = self.output.as_deref().filter(|path| check_scan_name(path).is_ok_and(|()| !is_pose(path))) {
            bail!("{}: -o writes the result, not a scan; use --write-aligned for the moved source", path.display());
        }
        self.write_aligned.as_deref().map_or(Ok(()), check_scan_name)?;
        let own = [&self.output, &self.write_aligned, &self.report].into_iter().flatten();
        let wanted: Vec<&Path> = own.chain(more).map(PathBuf::as_path).collect();
        outputs::check(inputs, &wanted)
    }
}

impl RawSource {
    pub(super) fn wanted(args: &ResultArgs) -> RawSource {
        if args.write_aligned.is_some() { RawSource::Kept } else { RawSource::Dropped }
    }
}

/// The step from two scans to an answer.
pub(super) type Registering<'a> =
    &'a (dyn Fn(Pair<&Scan>, &PipelineConfig, &dyn Fn(Stage)) -> (Registration, Trace) + Sync);

impl Aligned {
    /// Returns the content of its page; `config_text` is its configuration as TOML.
    pub(super) fn page_of<'a>(
        &'a self,
        names: &'a Pair<String>,
        config_text: &'a str,
        truth: Option<&'a RigidTransform>,
    ) -> PairReport<'a> {
        PairReport {
            names: names.as_ref().map(String::as_str),
            scans: self.scans.as_ref(),
            registration: &self.registration,
            trace: &self.trace,
            config: &self.config,
            config_text,
            truth,
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// Prints the answer and writes it to the files that were asked for.
    pub(super) fn put(&self, files: Pair<&Path>, args: &ResultArgs) -> Result<ExitCode> {
        if args.json {
            output::data(&self.report.json())?;
        } else {
            output::data(&self.report.summary())?;
        }
        if let Some(path) = &args.output {
            write_result(path, self)?;
        }
        if let Some(path) = &args.report {
            write_page(path, files, self, None)?;
        }
        if let Some(path) = &args.write_aligned {
            match (&self.registration.outcome, &self.raw_source) {
                (Outcome::Ok(found), Some(source)) => write_moved(path, source, &found.target_from_source)?,
                _ => output::remark(&format!("{}: not written, because the scans were not registered", path.display())),
            }
        }
        Ok(self.exit_code())
    }

    pub(super) fn exit_code(&self) -> ExitCode {
        match self.registration.verdict() {
            Verdict::Ok => ExitCode::SUCCESS,
            Verdict::Ambiguous | Verdict::Failed => ExitCode::from(NOT_REGISTERED),
        }
    }
}

/// Registers without any prior knowledge of the pose.
pub(super) fn unbounded(scans: Pair<&Scan>, config: &PipelineConfig, observe: &dyn Fn(Stage)) -> (Registration, Trace) {
    register_traced(scans, &Prior::default(), config, observe)
}

/// Reads and registers two files.
pub(super) fn align(
    files: Pair<&Path>,
    readings: Pair<Reading>,
    run: &RunArgs,
    raw_source: RawSource,
    registering: Registering<'_>,
) -> Result<Aligned> {
    let config = configuration::resolve(run)?;
    if readings.source.viewpoint.or(readings.target.viewpoint).is_some()
        && config.normals.orientation != (Orientation::Estimated {})
    {
        bail!(
            "the configured orientation of the normals ignores the viewpoint; add --set normals.orientation=estimated, \
             or omit the viewpoint"
        );
    }
    let start = Instant::now();
    let keeps = Pair { source: raw_source == RawSource::Kept, target: false };
    let loaded = files.zip(readings).zip(keeps).par_map(|((path, reading), keeps)| -> Result<_> {
        let Loaded { raw, scan } = load_as(path, reading)?;
        Ok((scan, keeps.then_some(raw)))
    });
    let (scans, raw) = loaded.both()?.unzip();
    let reading = start.elapsed();
    let progress = Progress::new();
    let (registration, trace) = registering(scans.as_ref(), &config, &|stage| progress.enter(stage));
    drop(progress);
    let report = Report::new(files, &config, &registration, reading, start.elapsed());
    Ok(Aligned { scans, raw_source: raw.source, registration, trace, config, report })
}

/// Returns whether a file name asks for the matrix alone.
fn is_pose(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "txt" || e == "xf")
}

/// Writes JSON, or the matrix alone if the file name asks for it.
fn write_result(path: &Path, aligned: &Aligned) -> Result<()> {
    let wants_matrix = is_pose(path);
    match aligned.registration.pose() {
        Some(pose) if wants_matrix => {
            write_pose(path, pose)?;
            if aligned.registration.verdict() != Verdict::Ok {
                output::remark(&format!("{}: contains the best guess, which is not trustworthy", path.display()));
            }
        }
        None if wants_matrix => output::remark(&format!("{}: not written, because there is no pose", path.display())),
        _ => write_file(path, format!("{}\n", aligned.report.json()).as_bytes())?,
    }
    Ok(())
}

/// Writes the page of a registration.
pub(super) fn write_page(
    path: &Path,
    files: Pair<&Path>,
    aligned: &Aligned,
    truth: Option<&RigidTransform>,
) -> Result<()> {
    let (names, text) = (names_of(files), toml::to_string(&aligned.config)?);
    write_file(path, pair_page(&aligned.page_of(&names, &text, truth)).html().as_bytes())?;
    Ok(())
}

/// Returns the names of files without their folders.
pub(super) fn names_of(files: Pair<&Path>) -> Pair<String> {
    files.map(|file| file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned())
}

/// Writes a scan moved by a rigid motion, with everything that the format can hold.
pub(super) fn write_moved(path: &Path, raw: &RawScan, motion: &RigidTransform) -> Result<()> {
    let written = write_scan(path, &raw.moved(motion))?;
    warn_of_losses(path, raw, &written);
    Ok(())
}
