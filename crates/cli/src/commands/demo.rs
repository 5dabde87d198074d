//! `congruent demo`: a first run that needs no data.

use super::align::{Aligned, RawSource, align, unbounded, write_moved, write_page};
use crate::args::DemoArgs;
use crate::{configuration, output, outputs};
use anyhow::{Result, bail};
use congruent_evaluation::GroundTruth;
use congruent_geometry::{RawScan, RigidTransform};
use congruent_io::{read_scan, write_file, write_ply, write_pose};
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

const SOURCE: &str = "source.ply";
const TARGET: &str = "target.ply";
const TRUTH: &str = "truth.txt";
const RESULT: &str = "result.json";
const REPORT: &str = "report.html";
const MOVED: &str = "aligned.ply";
const PICTURE: &str = "picture.svg";

pub(super) fn run(args: &DemoArgs) -> Result<ExitCode> {
    let directory = &args.directory;
    // An unusable configuration is reported before anything is written.
    configuration::resolve(&args.run)?;
    let pair = figurine_pair(&PairOptions {
        view_angle: VIEW_ANGLE.to_radians(),
        noise: RangeNoise::gaussian(NOISE),
        ..PairOptions::default()
    });
    check(directory, [&pair.source, &pair.target])?;
    outputs::create_folder(directory)?;
    let (source, target) = (directory.join(SOURCE), directory.join(TARGET));
    write_ply(&source, &pair.source.points, None, &[])?;
    write_ply(&target, &pair.target.points, None, &[])?;
    write_pose(&directory.join(TRUTH), &pair.target_from_source)?;
    output::remark(&format!(
        "A virtual scanner scanned a figurine from two sides, {VIEW_ANGLE} degrees apart; {:.0} % of the first scan is in \
         the second.",
        100.0 * pair.overlap
    ));

    let aligned =
        align(Pair { source: &source, target: &target }, Pair::default(), &args.run, RawSource::Dropped, &unbounded)?;
    output::data(&aligned.report.summary())?;
    write_file(&directory.join(RESULT), format!("{}\n", aligned.report.json()).as_bytes())?;
    let files = Pair { source: source.as_path(), target: target.as_path() };
    write_page(&directory.join(REPORT), files, &aligned, Some(&pair.target_from_source))?;
    let right = judge(&aligned, &pair.target_from_source)?;
    if let Outcome::Ok(found) = &aligned.registration.outcome {
        let pose = &found.target_from_source;
        write_moved(&directory.join(MOVED), &pair.source, pose)?;
        let points = Pair { source: &pair.source, target: &pair.target }.map(|scan| scan.points.to_vec());
        let picture = before_and_after(points.as_ref().map(Vec::as_slice), Some(pose));
        write_file(&directory.join(PICTURE), picture.as_bytes())?;
    }
    say_what_next(directory, aligned.registration.verdict() == Verdict::Ok);
    Ok(if right { aligned.exit_code() } else { ExitCode::FAILURE })
}

/// Refuses a directory with files of these names, unless an earlier demo wrote them: the scans there are then its own.
fn check(directory: &Path, scans: [&RawScan; 2]) -> Result<()> {
    let refuse = |name: &str| {
        let file = directory.join(name);
        bail!("{}: is not from an earlier demo, and would be replaced; choose another directory", file.display())
    };
    let mut is_own = false;
    for (name, scan) in [SOURCE, TARGET].into_iter().zip(scans) {
        let file = directory.join(name);
        if file.exists() {
            is_own = read_scan(&file).is_ok_and(|there| there.points == scan.points);
            if !is_own {
                return refuse(name);
            }
        }
    }
    let others = [TRUTH, RESULT, REPORT, MOVED, PICTURE];
    others.into_iter().find(|name| !is_own && directory.join(name).exists()).map_or(Ok(()), refuse)
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
        format!(", {} (the source moved), {} (a picture)", at(MOVED), at(PICTURE))
    } else {
        String::new()
    };
    output::remark(&format!(
        "Wrote {}, {}, {}, {}{moved}, {} (open it in a browser).\n\
         Next, your own scans: congruent align SOURCE.ply TARGET.ply --write-aligned aligned.ply",
        at(SOURCE),
        at(TARGET),
        at(TRUTH),
        at(RESULT),
        at(REPORT),
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_files_of_an_earlier_demo_are_replaced() {
        let scan =
            |x: f64| RawScan { points: vec![[x, 0.0, 0.1], [0.0, x, 0.0], [0.0, 0.0, x]].into(), ..RawScan::default() };
        let (source, target, own) = (scan(1.0), scan(2.0), scan(3.0));
        let after = |files: &[(&str, &RawScan)], others: &[&str]| {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            files.iter().for_each(|(name, scan)| write_ply(&at(name), &scan.points, None, &[]).unwrap());
            others.iter().for_each(|name| std::fs::write(at(name), "mine").unwrap());
            check(folder.path(), [&source, &target]).err().map(|error| error.to_string())
        };
        let refused = |message: Option<String>, name: &str| message.unwrap().contains(&format!("{name}: is not from"));
        assert_eq!(after(&[], &["notes.txt"]), None);
        assert_eq!(after(&[(SOURCE, &source)], &[]), None);
        assert_eq!(after(&[(SOURCE, &source), (TARGET, &target)], &[TRUTH, RESULT, REPORT]), None);
        assert!(refused(after(&[(SOURCE, &own), (TARGET, &target)], &[TRUTH]), SOURCE));
        assert!(refused(after(&[(SOURCE, &source), (TARGET, &own)], &[TRUTH]), TARGET));
        assert!(refused(after(&[], &[TARGET]), TARGET));
        assert!(refused(after(&[], &[RESULT]), RESULT));
    }
}
