//! `congruent reconstruct`.

use crate::args::{PairChoice, ReconstructArgs};
use crate::batch::{self, Ended, Input};
use crate::output;
use crate::reconstruct::{self, Surfaces};
use anyhow::{Result, bail};
use congruent_multiway::{Settings, reconstruct as solved};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Above so many scans not every pair is registered.
const ALL_PAIRS_UP_TO: usize = 40;
/// Some scan has no place, or there are several components.
const INCOMPLETE: u8 = 1;

pub(crate) fn run(args: &ReconstructArgs) -> Result<ExitCode> {
    if !args.folder.is_dir() {
        bail!("{}: is no folder; name one that holds scans", args.folder.display());
    }
    directories(&args.folder).iter().for_each(|path| {
        output::remark(&format!("warning: {}: is a directory and not taken for a scan", path.display()));
    });
    let n_scans = Input::find(&args.folder, Some(PairChoice::All), None)?.scans.len();
    let choice = if n_scans <= ALL_PAIRS_UP_TO { PairChoice::All } else { PairChoice::Auto };
    batch::run_then(&args.batch(args.pairs.unwrap_or(choice)), &|ended| reconstructed(args, ended))
}

/// Directories that are called like scans, wherever the scans are looked for.
fn directories(folder: &Path) -> Vec<PathBuf> {
    let entries =
        [folder.to_owned(), folder.join("scans")].into_iter().filter_map(|place| std::fs::read_dir(place).ok());
    let mut found: Vec<PathBuf> = entries.flatten().flatten().map(|entry| entry.path()).collect();
    found.retain(|path| path.is_dir() && path.extension().is_some());
    found.sort();
    found
}

fn reconstructed(args: &ReconstructArgs, ended: &Ended<'_>) -> Result<ExitCode> {
    // The pairs are done, and so is what hides their panics.
    drop(std::panic::take_hook());
    let Some(collection) = &ended.survey.collection else {
        bail!("{}: no scan there can be used; {} says why", args.folder.display(), args.output.display());
    };
    let threads = u16::try_from(ended.threads).ok();
    let pr = collection.lengths()[1];
    let (result, proposals, surfaces) = crate::commands::on_threads(threads, || {
        let surfaces = Surfaces::of(ended, pr);
        let proposals = reconstruct::proposals(ended, &surfaces);
        let candidates: Vec<_> = proposals.iter().filter_map(|p| p.candidate.clone()).collect();
        output::remark(&format!("{} poses between scans that touch; solving for all scans", candidates.len()));
        (solved(&surfaces.nodes(), &candidates, &surfaces, &Settings::new(pr)), proposals, surfaces)
    })?;
    let outcome = reconstruct::Outcome::new(ended, &result, proposals, &surfaces, pr);
    reconstruct::write(args, ended, &outcome, &surfaces)?;
    output::data(&if args.json { outcome.json() } else { outcome.text(&args.output) });
    Ok(if outcome.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(INCOMPLETE) })
}
