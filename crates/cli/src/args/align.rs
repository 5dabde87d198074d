//! `align` and `demo`: one pair.

use super::RunArgs;
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
    /// Where the scanner stood, in each file's own coordinates, if it is known; estimated otherwise
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) viewpoint: Option<[f64; 3]>,
    /// The same for the source alone
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) source_viewpoint: Option<[f64; 3]>,
    /// The same for the target alone
    #[arg(long, value_name = "X,Y,Z", value_parser = coordinates, allow_hyphen_values = true)]
    pub(crate) target_viewpoint: Option<[f64; 3]>,
    /// Print one JSON object instead of a summary
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the JSON object to FILE; a name ending in .txt or .xf gets the 4x4 matrix alone
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write the source in the target's frame, as PLY (only where the verdict is ok)
    #[arg(long, value_name = "FILE")]
    pub(crate) write_aligned: Option<PathBuf>,
    /// Write a page with the result and a 3D view, for a browser (one HTML file that needs no network)
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Write what each stage left into DIR: keypoints, descriptors, matches, poses (docs/FILES.md)
    #[arg(long, value_name = "DIR")]
    pub(crate) save_stages: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct DemoArgs {
    /// Where to write the scans and the result
    #[arg(default_value = "congruent-demo")]
    pub(crate) directory: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Three finite numbers with commas between them.
fn coordinates(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    numbers
        .and_then(|n| <[f64; 3]>::try_from(n).ok())
        .ok_or_else(|| "write three numbers, for instance 0,0,1.5".to_owned())
}
