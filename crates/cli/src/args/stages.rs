//! The commands that run a single stage.

use super::RunArgs;
use clap::Args as ClapArgs;
use congruent_geometry::Length;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
pub(crate) struct KeypointsArgs {
    /// The scan, in any format that align reads
    pub(crate) scan: PathBuf,
    /// Where to write x,y,z,response,index; stdout if not given
    #[arg(short, long, value_name = "FILE.csv")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct DescribeArgs {
    /// The scan, in any format that align reads
    pub(crate) scan: PathBuf,
    /// Describe these points (columns x,y,z) instead of those that the detector finds
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) keypoints: Option<PathBuf>,
    /// Where to write the matrix; the positions of its rows are written beside it, to the same name with .csv
    #[arg(short, long, value_name = "FILE.npy")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct MatchArgs {
    /// Descriptors of the source, with the positions of the rows beside them in .csv
    #[arg(value_name = "SOURCE.npy")]
    pub(crate) source: PathBuf,
    /// Descriptors of the target
    #[arg(value_name = "TARGET.npy")]
    pub(crate) target: PathBuf,
    /// Where to write the correspondences; stdout if not given
    #[arg(short, long, value_name = "FILE.csv")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct EstimateArgs {
    /// Correspondences, best first: CSV of `congruent match`, lines `sx sy sz tx ty tz`, or pairs of point indices
    pub(crate) matches: PathBuf,
    /// The scan to be moved; needed for pairs of point indices and for anything that uses the surfaces
    #[arg(long, value_name = "SCAN", requires = "target")]
    pub(crate) source: Option<PathBuf>,
    /// The scan that stays
    #[arg(long, value_name = "SCAN", requires = "source")]
    pub(crate) target: Option<PathBuf>,
    /// Print one JSON object instead of a summary
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the JSON object to FILE
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
}

/// What the commands take that run a stage by itself.
#[derive(Debug, ClapArgs)]
pub(crate) struct StageArgs {
    /// Length of one pr after sampling, in data units (0.6u); if not given, measured on the scans
    #[arg(long, value_name = "LENGTH", value_parser = data_units)]
    pub(crate) resolution: Option<f64>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Parses a length that does not need a resolution.
pub(super) fn data_units(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(Length::Units(units)) => Ok(units),
        Ok(Length::Resolutions(_)) => Err("this length cannot be given in pr; write data units, as in 0.6u".to_owned()),
        Err(_) => Err("write a number above zero in data units, as in 0.6u".to_owned()),
    }
}
