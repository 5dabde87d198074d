//! `congruent align`: two scans in, one pose out.

use super::stages::save;
use super::{Loaded, load_seen_from, on_threads};
use crate::args::{AlignArgs, RunArgs};
use crate::progress::Progress;
use crate::result::Report;
use crate::{configuration, output};
use anyhow::Result;
use congruent_geometry::{RawScan, RigidTransform};
use congruent_io::{write_file, write_ply, write_pose};
use congruent_pipeline::{Pair, PipelineConfig, Registration, Trace, Verdict, register_traced};
use congruent_report::{PairReport, pair_page};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// The verdict is `failed` or `ambiguous`.
pub(super) const NOT_REGISTERED: u8 = 1;

pub(super) fn run(args: &AlignArgs) -> Result<ExitCode> {
    let files = Pair { source: args.source.as_path(), target: args.target.as_path() };
    let viewpoints =
        Pair { source: args.source_viewpoint.or(args.viewpoint), target: args.target_viewpoint.or(args.viewpoint) };
    let mut aligned = align(files, viewpoints, &args.run)?;
    if let Some(path) = &args.report {
        write_page(path, files, &aligned, None)?;
    }
    if let Some(directory) = &args.save_stages {
        let trace = std::mem::take(&mut aligned.trace);
        save(directory, trace, aligned.scans.as_ref().into_map(|loaded| &loaded.scan))?;
    }
    if args.json {
        output::data(&aligned.report.json());
    } else {
        output::data(&aligned.report.summary());
    }
    if let Some(path) = &args.output {
        write_result(path, &aligned)?;
    }
    if let Some(path) = &args.write_aligned {
        match (&aligned.registration.verdict, &aligned.registration.target_from_source) {
            (Verdict::Ok, Some(pose)) => write_moved(path, &aligned.scans.source.raw, pose)?,
            _ => output::remark(&format!("{}: not written, because the scans were not registered", path.display())),
        }
    }
    Ok(aligned.exit_code())
}

/// Two scans, registered.
pub(super) struct Aligned {
    pub(super) scans: Pair<Loaded>,
    pub(super) registration: Registration,
    pub(super) trace: Trace,
    pub(super) config: PipelineConfig,
    pub(super) report: Report,
}

impl Aligned {
    /// What its page shows; `config_text` is its configuration as TOML.
    pub(super) fn page_of<'a>(
        &'a self,
        names: &'a Pair<String>,
        config_text: &'a str,
        truth: Option<&'a RigidTransform>,
    ) -> PairReport<'a> {
        PairReport {
            names: names.as_ref().into_map(String::as_str),
            scans: self.scans.as_ref().into_map(|loaded| &loaded.scan),
            registration: &self.registration,
            trace: &self.trace,
            config: &self.config,
            config_text,
            truth,
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    pub(super) fn exit_code(&self) -> ExitCode {
        match self.registration.verdict {
            Verdict::Ok => ExitCode::SUCCESS,
            Verdict::Ambiguous | Verdict::Failed(_) => ExitCode::from(NOT_REGISTERED),
        }
    }
}

/// Reads and registers two files; `viewpoints` are in file coordinates and go before what the files say.
pub(super) fn align(files: Pair<&Path>, viewpoints: Pair<Option<[f64; 3]>>, run: &RunArgs) -> Result<Aligned> {
    let config = configuration::resolve(run)?;
    let start = Instant::now();
    let (scans, (registration, trace), reading) =
        on_threads(run.threads, || -> Result<(Pair<Loaded>, (Registration, Trace), Duration)> {
            let scans = files.zip(viewpoints).map(|&(path, viewpoint)| load_seen_from(path, viewpoint)).both()?;
            let reading = start.elapsed();
            let progress = Progress::new();
            let registration =
                register_traced(&scans.source.scan, &scans.target.scan, &config, &|stage| progress.enter(stage));
            Ok((scans, registration, reading))
        })??;
    let report = Report::new(files, &config, &registration, reading, start.elapsed());
    Ok(Aligned { scans, registration, trace, config, report })
}

/// JSON, or the matrix alone where the name asks for it.
fn write_result(path: &Path, aligned: &Aligned) -> Result<()> {
    let wants_matrix = path.extension().is_some_and(|e| e == "txt" || e == "xf");
    match &aligned.registration.target_from_source {
        Some(pose) if wants_matrix => write_pose(path, pose)?,
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

/// The names of files without their folders.
pub(super) fn names_of(files: Pair<&Path>) -> Pair<String> {
    files.into_map(|file| file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned())
}

/// Writes a scan under a rigid motion, with its normals and triangles.
pub(super) fn write_moved(path: &Path, raw: &RawScan, motion: &RigidTransform) -> Result<()> {
    let points: Vec<[f64; 3]> =
        raw.points.iter().map(|p| (motion * nalgebra::Point3::from(*p)).coords.into()).collect();
    let turned = |n: &[f32; 3]| congruent_geometry::narrow(&(motion.rotation * congruent_geometry::wide(*n)));
    let normals: Option<Vec<_>> = raw.normals.as_ref().map(|normals| normals.iter().map(turned).collect());
    write_ply(path, &points, normals.as_deref(), &raw.triangles)?;
    Ok(())
}
