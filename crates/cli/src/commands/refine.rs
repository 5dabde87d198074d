//! `congruent refine`: a rough pose in, an exact one out.

use super::align::{RawSource, align, readings};
use crate::args::RefineArgs;
use crate::guess::{level_pose, up};
use anyhow::Result;
use congruent_pipeline::{Guess, Pair, refine_traced};
use std::process::ExitCode;

pub(super) fn run(args: &RefineArgs) -> Result<ExitCode> {
    let start = Guess::new(level_pose(&args.init, &args.level)?);
    let up = up(&args.level);
    let files = Pair { source: args.source.as_path(), target: args.target.as_path() };
    args.output.check(&[files.source, files.target, args.init.as_path()], &[])?;
    let refined = align(
        files,
        readings(&args.viewpoints, args.reading),
        &args.run,
        RawSource::wanted(&args.output),
        &|scans, config, observe| refine_traced(scans, &start, up, config, observe),
    )?;
    refined.put(files, &args.output)
}
