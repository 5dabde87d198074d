//! `align`, `refine` and `demo`: one pair.

use super::{LevelArgs, PriorArgs, ReadingArgs, RunArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
pub(crate) struct AlignArgs {
    /// The scan to be moved: points or a mesh (PLY, OBJ, STL, OFF, PCD, XYZ/TXT/CSV, LAS/LAZ, E57)
    pub(crate) source: PathBuf,
    /// The scan that stays
    pub(crate) target: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) prior: PriorArgs,
    #[command(flatten)]
    pub(crate) viewpoints: ViewpointArgs,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) output: ResultArgs,
    /// Write what each stage produced into DIR: keypoints, descriptors, matches, poses (docs/FILES.md)
    #[arg(long, value_name = "DIR")]
    pub(crate) save_stages: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct RefineArgs {
    /// The scan to be moved: points or a mesh (PLY, OBJ, STL, OFF, PCD, XYZ/TXT/CSV, LAS/LAZ, E57)
    pub(crate) source: PathBuf,
    /// The scan that stays
    pub(crate) target: PathBuf,
    /// The pose to start from, which maps SOURCE into the frame of TARGET: a file with a 4x4 matrix, a JSON result of
    /// align, or the word identity
    #[arg(long, value_name = "POSE")]
    pub(crate) init: PathBuf,
    #[command(flatten)]
    pub(crate) level: LevelArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) viewpoints: ViewpointArgs,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) output: ResultArgs,
}

/// From where the scans were taken.
#[derive(Debug, Default, ClapArgs)]
pub(crate) struct ViewpointArgs {
    /// Position of the scanner in each file's own coordinates; if not given, the one in the file, otherwise estimated
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) viewpoint: Option<[f64; 3]>,
    /// The same for the source only
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) source_viewpoint: Option<[f64; 3]>,
    /// The same for the target only
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) target_viewpoint: Option<[f64; 3]>,
}

/// Where the answer for one pair goes.
#[derive(Debug, ClapArgs)]
pub(crate) struct ResultArgs {
    /// Print one JSON object instead of a summary
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the JSON object to FILE, or only the 4x4 matrix if the name ends in .txt or .xf
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write the source in the target's frame; the extension chooses the format (only if the verdict is ok)
    #[arg(long, value_name = "FILE")]
    pub(crate) write_aligned: Option<PathBuf>,
    /// Write a page with the result and a 3D view (one HTML file that needs no network)
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct DemoArgs {
    /// Where to write the scans and the result
    #[arg(default_value = "congruent-demo")]
    pub(crate) directory: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Parses three finite numbers separated by commas.
pub(super) fn coordinates(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    numbers.and_then(|n| <[f64; 3]>::try_from(n).ok()).ok_or_else(|| "write three numbers, e.g. 0,0,1.5".to_owned())
}
