//! `congruent match`: matches the descriptors of two scans.

use super::stages::{Described, put};
use crate::args::MatchArgs;
use crate::{configuration, outputs};
use anyhow::{Result, bail};
use congruent_descriptors::Features;
use congruent_io::{MatchRow, matches_csv};
use congruent_pipeline::Pair;
use congruent_pipeline::stages::match_features;
use std::process::ExitCode;

pub(super) fn run(args: &MatchArgs) -> Result<ExitCode> {
    let config = configuration::resolve(&args.run)?;
    outputs::check(&[&args.source, &args.target], args.output.as_deref().as_slice())?;
    let both = Pair { source: Described::read(&args.source)?, target: Described::read(&args.target)? };
    let (source, target) = (both.source.matrix.columns, both.target.matrix.columns);
    if source != target {
        bail!(
            "{}: has {target} numbers per row, {} has {source}; describe both scans with the same descriptor",
            args.target.display(),
            args.source.display()
        );
    }
    let (places, features) = both.map(numbered).unzip();
    let matches = match_features(&features.source, &features.target, &config);
    let row = |m: &congruent_matching::Correspondence| MatchRow {
        source: places.source[m.source as usize],
        target: places.target[m.target as usize],
        source_row: m.source,
        target_row: m.target,
        distance: m.distance,
        score: m.score,
    };
    let rows: Vec<MatchRow> = matches.iter().map(row).collect();
    put(args.output.as_deref(), &matches_csv(&rows))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns places and features in which each row is its own keypoint number.
fn numbered(Described { matrix, places }: Described) -> (Vec<congruent_io::Place>, Features) {
    let keypoints = (0..).take(places.len()).collect();
    (places, Features { keypoints, dim: matrix.columns, rows: matrix.values })
}
