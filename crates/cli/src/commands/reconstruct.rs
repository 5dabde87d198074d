//! `congruent reconstruct`: many scans into one frame.

use crate::args::{PairChoice, ReconstructArgs};
use crate::batch::{self, Ended, Input};
use crate::output;
use crate::reconstruct::{self, Pairs};
use anyhow::{Result, bail};
use congruent_pipeline::Variant;
use congruent_reconstruction::{Solved, Surfaces, proposals};
use std::path::Path;
use std::process::ExitCode;

/// Maximum number of scans for which every pair is registered.
const ALL_PAIRS_UP_TO: usize = 40;
/// Exit code if some scan has no place, there are several components, or scans contradict each other.
const DOUBTFUL: u8 = 1;

pub(crate) fn run(args: &ReconstructArgs) -> Result<ExitCode> {
    if !args.folder.is_dir() {
        bail!("{}: is not a folder; give one that contains scans", args.folder.display());
    }
    let input = Input::find(&args.folder, Some(PairChoice::All), None)?;
    let holds_scans =
        |place: &Path| place.canonicalize().is_ok_and(|place| args.output.canonicalize().is_ok_and(|o| o == place));
    if input.scans.iter().filter_map(|scan| scan.path.parent()).any(holds_scans) {
        let output = args.output.display();
        bail!("{output}: contains the scans, so the model would be mistaken for one; choose another folder for -o");
    }
    let choice = if input.scans.len() <= ALL_PAIRS_UP_TO { PairChoice::All } else { PairChoice::Auto };
    let choice = args.pairs.unwrap_or(choice);
    batch::run_then(&args.batch(choice), input.choosing(choice), &|ended| reconstructed(args, ended))
}

fn reconstructed(args: &ReconstructArgs, ended: &Ended<'_>) -> Result<ExitCode> {
    let Some(collection) = &ended.survey.collection else {
        bail!("{}: no scan there can be used; see {}", args.folder.display(), args.output.display());
    };
    let described = |at: usize| ended.survey.described(ended.input, ended.cache, at, Variant::default()).ok();
    let surfaces = Surfaces::new(ended.input.scans.len(), described, collection.resolution());
    let (ids, registered) = reconstruct::registered(ended);
    let proposals = proposals(&registered, &surfaces);
    let touching = proposals.iter().filter(|proposal| proposal.candidate.is_some()).count();
    output::remark(&format!("{touching} poses between scans that touch; solving for all scans"));
    let solved = Solved::new(proposals, &surfaces);
    let pairs = Pairs { ids: &ids, registered: &registered };
    let outcome = reconstruct::Outcome::new(ended, &solved, &pairs, &surfaces, collection.resolution());
    reconstruct::write(args, ended, &outcome, &surfaces)?;
    output::data(&if args.json { outcome.json() } else { outcome.text(&args.output) })?;
    Ok(if outcome.is_complete() && outcome.is_consistent() { ExitCode::SUCCESS } else { ExitCode::from(DOUBTFUL) })
}
