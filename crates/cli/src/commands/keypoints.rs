//! `congruent keypoints`: the points of a scan that are worth describing.

use super::stages::{Single, keypoint_rows, put};
use crate::args::KeypointsArgs;
use crate::{configuration, outputs};
use anyhow::Result;
use congruent_io::keypoints_csv;
use congruent_pipeline::stages::detect;
use std::process::ExitCode;

pub(super) fn run(args: &KeypointsArgs) -> Result<ExitCode> {
    let config = configuration::resolve(&args.stage.run)?;
    outputs::check(&[&args.scan], args.output.as_deref().as_slice())?;
    let Single { scan, surface, resolution } = Single::load(&args.scan, &args.stage, &config)?;
    let rows = keypoint_rows(&surface, &detect(&surface, &config, resolution), scan.origin());
    put(args.output.as_deref(), &keypoints_csv(&rows))?;
    Ok(ExitCode::SUCCESS)
}
