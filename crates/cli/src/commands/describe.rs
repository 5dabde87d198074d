//! `congruent describe`: descriptors of a scan at its keypoints.

use super::stages::{Described, Single, read_keypoints, sibling};
use crate::args::DescribeArgs;
use crate::{configuration, output, outputs};
use anyhow::Result;
use congruent_pipeline::stages::{describe, detect};
use std::path::Path;
use std::process::ExitCode;

pub(super) fn run(args: &DescribeArgs) -> Result<ExitCode> {
    let config = configuration::resolve(&args.stage.run)?;
    // Checked before the work, not after it.
    let places = sibling(&args.output)?;
    let keypoints = args.keypoints.as_deref();
    let inputs: Vec<&Path> = keypoints.into_iter().chain([args.scan.as_path()]).collect();
    outputs::check(&inputs, &[&args.output, &places])?;
    let single = Single::load(&args.scan, &args.stage, &config)?;
    let Single { scan, surface, resolution } = &single;
    let points = match &args.keypoints {
        Some(path) => read_keypoints(path, &single)?,
        None => detect(surface, &config, *resolution).iter().map(|keypoint| keypoint.index).collect(),
    };
    let features = describe(surface, &points, &config, *resolution);
    output::remark(&format!("{} of {} keypoints could be described", features.len(), points.len()));
    Described::new(features, surface, scan.origin()).write(&args.output)?;
    Ok(ExitCode::SUCCESS)
}
