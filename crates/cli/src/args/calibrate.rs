//! `calibrate`: how far the confidence can be trusted.

use super::RunArgs;
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, ClapArgs)]
pub(crate) struct CalibrateArgs {
    /// Data sets with ground truth, as for evaluate
    #[arg(required = true, value_name = "DATASET")]
    pub(crate) datasets: Vec<PathBuf>,
    /// Where to write rows.jsonl, calibration.toml and calibration.md
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Names of data sets that show the same objects: their scans are not paired with each other; may be repeated, once for
    /// each object
    #[arg(long, value_name = "A,B")]
    pub(crate) alike: Vec<Alike>,
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

/// The names of data sets that show the same objects, at least two.
#[derive(Clone, Debug)]
pub(crate) struct Alike(Vec<String>);

impl Alike {
    pub(crate) fn names(&self) -> &[String] {
        &self.0
    }

    pub(crate) fn includes(&self, dataset: &str) -> bool {
        self.0.iter().any(|name| name == dataset)
    }
}

impl FromStr for Alike {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Alike, &'static str> {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
        match names.len() {
            2.. if names.iter().all(|name| !name.is_empty()) => Ok(Alike(names)),
            _ => Err("write the names of all data sets that show the same object, e.g. A,B"),
        }
    }
}
