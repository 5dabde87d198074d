//! `congruent demo`: a first run that needs no data.

use super::align::{Aligned, RawSource, align, unbounded, write_moved, write_page};
use crate::args::DemoArgs;
use crate::{configuration, output};
use anyhow::{Context, Result};
use congruent_evaluation::GroundTruth;
use congruent_geometry::RigidTransform;
use congruent_io::{write_file, write_ply, write_pose};
use congruent_pipeline::{Outcome, Pair, Verdict};
use congruent_report::before_and_after;
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::RangeNoise;
use std::path::Path;
use std::process::ExitCode;

/// Range noise of the virtual scanner, data units (the figurine is 100 tall).
const NOISE: f64 = 0.05;
/// Angle between the two views, degrees.
const VIEW_ANGLE: f64 = 40.0;
/// A pose is right if its mean error is below this many resolutions (the paper's bound).
const RIGHT_WITHIN_PR: f64 = 2.5;

pub(super) fn run(args: &DemoArgs) -> Result<ExitCode> {
    let directory = &args.directory;
    // An unusable configuration is reported before anything is written.
    configuration::resolve(&args.run)?;
    std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot be created", directory.display()))?;
    let pair = figurine_pair(&PairOptions {
        view_angle: VIEW_ANGLE.to_radians(),
        noise: RangeNoise::gaussian(NOISE),
        ..PairOptions::default()
    });
    let (source, target) = (directory.join("source.ply"), directory.join("target.ply"));
    write_ply(&source, &pair.source.points, None, &[])?;
    write_ply(&target, &pair.target.points, None, &[])?;
    write_pose(&directory.join("truth.txt"), &pair.target_from_source)?;
    output::remark(&format!(
        "A virtual scanner scanned a figurine from two sides, {VIEW_ANGLE} degrees apart; {:.0} % of the first scan is in \
         the second.",
        100.0 * pair.overlap
    ));

    let aligned =
        align(Pair { source: &source, target: &target }, Pair::default(), &args.run, RawSource::Dropped, &unbounded)?;
    output::data(&aligned.report.summary())?;
    write_file(&directory.join("result.json"), format!("{}\n", aligned.report.json()).as_bytes())?;
    let files = Pair { source: source.as_path(), target: target.as_path() };
    write_page(&directory.join("report.html"), files, &aligned, Some(&pair.target_from_source))?;
    let right = judge(&aligned, &pair.target_from_source)?;
    if let Outcome::Ok(found) = &aligned.registration.outcome {
        let pose = &found.target_from_source;
        write_moved(&directory.join("aligned.ply"), &pair.source, pose)?;
        let scans = Pair { source: pair.source.points.as_slice(), target: pair.target.points.as_slice() };
        let picture = before_and_after(scans, Some(pose));
        write_file(&directory.join("picture.svg"), picture.as_bytes())?;
    }
    say_what_next(directory, aligned.registration.verdict() == Verdict::Ok);
    Ok(if right { aligned.exit_code() } else { ExitCode::FAILURE })
}

/// Compares the answer with the ground truth, and returns whether it is right.
fn judge(aligned: &Aligned, truth: &RigidTransform) -> Result<bool> {
    let truth = GroundTruth::of_scans(aligned.scans.as_ref(), truth);
    let Some(errors) = aligned.registration.pose().and_then(|pose| truth.errors(pose)) else {
        output::data("           truth  no pose to compare")?;
        return Ok(false);
    };
    let right = errors.rmse_pr < RIGHT_WITHIN_PR;
    output::data(&format!(
        "           truth  {}: off by {:.2} pr (resolutions) where the scans overlap, {:.2} degrees",
        if right { "right" } else { "wrong" },
        errors.rmse_pr,
        errors.rotation_deg
    ))?;
    Ok(right)
}

fn say_what_next(directory: &Path, aligned: bool) {
    let at = |name: &str| directory.join(name).display().to_string();
    let moved = if aligned {
        format!(", {} (the source moved), {} (a picture)", at("aligned.ply"), at("picture.svg"))
    } else {
        String::new()
    };
    output::remark(&format!(
        "Wrote {}, {}, {}, {}{moved}, {} (open it in a browser).\n\
         Next, your own scans: congruent align SOURCE.ply TARGET.ply --write-aligned aligned.ply",
        at("source.ply"),
        at("target.ply"),
        at("truth.txt"),
        at("result.json"),
        at("report.html"),
    ));
}
