//! `calibrate`: how far the confidence can be trusted.

use super::RunArgs;
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
pub(crate) struct CalibrateArgs {
    /// Data sets with ground truth, as for evaluate
    #[arg(required = true, value_name = "DATASET")]
    pub(crate) datasets: Vec<PathBuf>,
    /// Where to write rows.jsonl, calibration.toml and calibration.md
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Names of data sets that show the same objects: their scans are not paired with each other; may be repeated
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(crate) alike: Vec<String>,
    /// Number of pairs of scans from different data sets
    #[arg(long, value_name = "N", default_value_t = 400)]
    pub(crate) crossed: usize,
    /// Simulated pairs of each kind (see simulate)
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub(crate) simulated: usize,
    /// Simulated pairs of each shape that does not determine the pose
    #[arg(long, value_name = "N", default_value_t = 15)]
    pub(crate) open: usize,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}
