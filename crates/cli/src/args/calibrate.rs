//! `calibrate`: how far the confidence can be trusted.

use super::RunArgs;
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
pub(crate) struct CalibrateArgs {
    /// Data sets with their truth, as for evaluate
    #[arg(required = true, value_name = "DATASET")]
    pub(crate) datasets: Vec<PathBuf>,
    /// Where to write rows.jsonl, calibration.toml and calibration.md
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Data sets that show the same objects: their scans are not crossed. Names of folders; may be repeated
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(crate) alike: Vec<String>,
    /// Pairs of scans of different data sets
    #[arg(long, value_name = "N", default_value_t = 400)]
    pub(crate) crossed: usize,
    /// Simulated pairs of each kind (see simulate)
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub(crate) simulated: usize,
    /// Simulated pairs of each shape that leaves the pose open
    #[arg(long, value_name = "N", default_value_t = 15)]
    pub(crate) open: usize,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}
