//! `congruent calibrate`: registers pairs whose truth is known, and fits the confidence to the outcomes.

mod crossed;
mod listed;
mod objects;
mod rows;
mod simulated;
#[cfg(test)]
mod testing;

use crate::args::{Alike, CalibrateArgs};
use crate::commands::{listed_pairs, named_once};
use crate::fingerprint::fingerprint;
use crate::progress::Bar;
use crate::{configuration, output};
use anyhow::{Context, Result, bail};
use congruent_evaluation::GroundTruth;
use congruent_evaluation::calibration::{AttemptRow, CalibrationRow, Origin, Validation};
use congruent_geometry::{RawScan, RigidTransform, Scan, mean_displacement, uncentred};
use congruent_io::{Dataset, write_file};
use congruent_pipeline::{DenseVerdictConfig, Pair, PipelineConfig, VerdictConfig, register_tried};
use objects::Objects;
use rows::Rows;
use std::process::ExitCode;

/// Exit code if some pairs had a scan that could not be used.
const SOME_ERRORS: u8 = 1;

/// No further attempt is made after one with this confidence: it would be accepted with any calibration.
const BEYOND_DOUBT: f64 = 0.9999;

/// Rival poses are examined for answers with at least this confidence, that is, for all that could be accepted.
const BELIEVABLE: f64 = 0.2;

/// A pair to be registered.
struct Trial<'a> {
    /// Unique name.
    id: String,
    /// Names of the objects that its scans show, at least one; all trials that show the same object have its name.
    groups: Vec<String>,
    origin: Origin,
    /// Loads or generates the scans.
    scene: SceneMaker<'a>,
}

type SceneMaker<'a> = Box<dyn Fn() -> Result<Scene> + Send + Sync + 'a>;

/// Two scans, and what is known about them.
struct Scene {
    scans: Pair<RawScan>,
    /// `None` if no pose is right.
    target_from_source: Option<RigidTransform>,
}

pub(crate) fn run(args: &CalibrateArgs) -> Result<ExitCode> {
    let config = configuration::resolve(&args.run)?;
    let VerdictConfig::Dense(verdict) = &config.verdict else {
        bail!("only the confidence of [verdict.dense] can be calibrated; choose a configuration with it");
    };
    let mut datasets: Vec<Dataset> = Vec::new();
    for path in &args.datasets {
        let one = listed_pairs(path, None, None)?;
        named_once(path, &one.name, datasets.iter().map(|other| &other.name))?;
        datasets.push(one);
    }
    check_alike(&args.alike, &datasets)?;
    let trials = trials(args, &datasets, config.seed);
    let looking = PipelineConfig { verdict: VerdictConfig::Dense(open_to_all(verdict)), ..config.clone() };
    let made_by = fingerprint(&[env!("CARGO_PKG_VERSION"), &toml::to_string(&looking)?]);
    let mut rows = Rows::open(&args.output, made_by)?;
    let errors = register_all(&trials, &looking, &mut rows)?;
    let rows = rows.of(&trials);
    let validation = Validation::new(&rows, verdict);
    let figures = validation.to_string();
    write_file(&args.output.join("calibration.toml"), calibration_file(&validation)?.as_bytes())?;
    write_file(&args.output.join("calibration.md"), figures.as_bytes())?;
    output::data(figures.trim_end())?;
    Ok(if errors == 0 { ExitCode::SUCCESS } else { ExitCode::from(SOME_ERRORS) })
}

/// Returns the settings under which rows are made: from these rows the answer under any `rival-odds`, and under any
/// `min-confidence` above [`BELIEVABLE`], can be derived. With the lowest odds, no pose that comes close keeps another one
/// from being examined.
fn open_to_all(verdict: &DenseVerdictConfig) -> DenseVerdictConfig {
    DenseVerdictConfig {
        min_confidence: BELIEVABLE.min(verdict.min_confidence),
        rival_odds: f64::MIN_POSITIVE,
        ..verdict.clone()
    }
}

/// Refuses names of data sets that are not among those given, or that show two objects.
fn check_alike(alike: &[Alike], datasets: &[Dataset]) -> Result<()> {
    let known: Vec<&str> = datasets.iter().map(|dataset| dataset.name.as_str()).collect();
    let mut seen: Vec<&String> = Vec::new();
    for name in alike.iter().flat_map(Alike::names) {
        if !known.contains(&name.as_str()) {
            bail!("--alike: no data set is called `{name}`; there are: {}", known.join(", "));
        }
        if seen.contains(&name) {
            bail!("--alike names `{name}` twice; list all data sets that show the same object once, as in A,B,C");
        }
        seen.push(name);
    }
    Ok(())
}

fn trials<'a>(args: &CalibrateArgs, datasets: &'a [Dataset], seed: u64) -> Vec<Trial<'a>> {
    let objects = Objects::of(datasets, &args.alike);
    let mut trials: Vec<Trial<'a>> = datasets.iter().flat_map(|set| listed::trials(set, &objects)).collect();
    trials.extend(crossed::trials(datasets, &objects, &args.alike, args.crossed, seed));
    trials.extend(simulated::trials(args.simulated, seed));
    trials.extend(simulated::open_trials(args.open));
    trials
}

/// Adds the rows that are missing; returns the number of pairs that could not be used.
fn register_all(trials: &[Trial<'_>], config: &PipelineConfig, rows: &mut Rows) -> Result<usize> {
    let bar = Bar::new(trials.len() as u64);
    let mut errors = 0;
    for (done, trial) in (1..).zip(trials) {
        bar.at(done, trial.id.as_str());
        if rows.has(&trial.id) {
            continue;
        }
        match registered(trial, config) {
            Ok(row) => rows.add(row)?,
            Err(error) => {
                errors += 1;
                output::remark(&format!("{}: skipped: {error:#}", trial.id));
            }
        }
    }
    Ok(errors)
}

fn registered(trial: &Trial<'_>, config: &PipelineConfig) -> Result<CalibrationRow> {
    let Scene { scans, target_from_source } = (trial.scene)()?;
    let scans = scans.par_map(|raw| Scan::new(&raw)).both().context("a scan cannot be used")?;
    let tried = register_tried(&scans.source, &scans.target, config, BEYOND_DOUBT);
    let error = |pose| target_from_source.as_ref().map(|truth| error_pr(scans.as_ref(), truth, pose));
    let attempts = tried.iter().filter_map(|tried| AttemptRow::new(tried, error(&tried.target_from_source))).collect();
    Ok(CalibrationRow { id: trial.id.clone(), groups: trial.groups.clone(), origin: trial.origin, attempts })
}

/// Returns the error of a pose, `pr`: over the surface that both scans share, or over the whole source if they share
/// too little.
fn error_pr(scans: Pair<&Scan>, truth: &RigidTransform, pose: &RigidTransform) -> f64 {
    let known = GroundTruth::of_scans(Pair { source: scans.source, target: scans.target }, truth);
    known.errors(pose).map_or_else(
        || {
            let centred = uncentred(pose, &-scans.source.origin(), &-scans.target.origin());
            mean_displacement(scans.source.points(), &centred, known.centred()) / known.resolution()
        },
        |errors| errors.rmse_pr,
    )
}

/// Returns the coefficients as a TOML file, with comments on their origin.
fn calibration_file(validation: &Validation<'_>) -> Result<String> {
    let n_rows = validation.learnt_from();
    let (right_said, said, right) = validation.believed();
    Ok(format!(
        "# Logistic model of a right answer, made by `congruent calibrate` from {n_rows} pairs.\n\
         # Cross-validated: AUC {:.4}; {right_said} of {said} answers called ok are right, {right_said} of {right} right ones \
         are called ok.\n{}",
        validation.auc(),
        toml::to_string(&validation.calibration)?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::testing::dataset;

    #[test]
    fn settings_that_rows_do_not_depend_on_leave_them_as_they_are() {
        let usual = DenseVerdictConfig::default();
        for (verdict, is_same) in [
            (DenseVerdictConfig { min_confidence: 0.5, ..usual.clone() }, true),
            (DenseVerdictConfig { rival_odds: 3.0, ..usual.clone() }, true),
            (DenseVerdictConfig { min_confidence: 0.1, ..usual.clone() }, false),
            (DenseVerdictConfig { rival_score: 0.5, ..usual.clone() }, false),
        ] {
            assert_eq!(open_to_all(&verdict) == open_to_all(&usual), is_same, "{verdict:?}");
        }
    }

    #[test]
    fn data_sets_that_are_alike_are_given_and_named_once() {
        let datasets = ["bunny", "kinect", "chef"].map(|name| dataset(name, Vec::new()));
        let said = |lists: &[&str]| {
            let alike: Vec<Alike> = lists.iter().map(|names| names.parse().unwrap()).collect();
            check_alike(&alike, &datasets).err().map(|error| error.to_string())
        };
        assert_eq!(said(&["bunny, kinect"]), None);
        let unknown = said(&["bunny,kinekt"]).unwrap();
        assert!(unknown.contains("`kinekt`; there are: bunny, kinect, chef"), "{unknown}");
        let twice = said(&["bunny,kinect", "kinect,chef"]).unwrap();
        assert!(twice.contains("`kinect` twice"), "{twice}");
        for lone in ["bunny", "bunny,", ""] {
            assert!(lone.parse::<Alike>().is_err(), "{lone}");
        }
    }
}
