//! `batch` and `merge`: many pairs.

use super::{ReadingArgs, RunArgs};
use crate::batch::Share;
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, ClapArgs)]
pub(crate) struct BatchArgs {
    /// A folder of scans, a table of pairs (.csv, .jsonl, .parquet), a folder with pairs.csv and scans/, or a dataset.toml
    pub(crate) input: PathBuf,
    /// Where to write results.jsonl, results.csv, run.json and configuration.toml
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Which pairs of a folder or data set; if not given, those that it lists, otherwise all
    #[arg(long, value_name = "CHOICE", conflicts_with = "sequential")]
    pub(crate) pairs: Option<PairChoice>,
    /// Pair each scan with the one before it, by file name (the same as --pairs sequential)
    #[arg(long)]
    pub(crate) sequential: bool,
    /// For --pairs auto: number of most similar scans to pair each scan with [default: 8]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) neighbors: Option<u32>,
    /// Folder with the files of a dataset.toml, if not beside it
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Continue a stopped run: pairs with a verdict are kept, the others are repeated
    #[arg(long)]
    pub(crate) resume: bool,
    /// Register only the i-th of n parts of the pairs; merge joins the parts. The rows do not depend on it
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(crate) shard: Share,
    /// Give up pairs that take longer, in seconds or as 90s, 5m, 1h. Checked between stages
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time_limit: Option<Duration>,
    /// Approximate memory for running pairs and cached descriptors, in bytes or as 500M, 4G
    #[arg(long, value_name = "SIZE", default_value = "1G", value_parser = bytes)]
    pub(crate) memory: u64,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

impl BatchArgs {
    pub(crate) fn wanted(&self) -> Option<PairChoice> {
        if self.sequential { Some(PairChoice::Sequential) } else { self.pairs }
    }
}

/// Which pairs of the scans in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PairChoice {
    /// Every pair of scans
    All,
    /// Each scan with the one before it, by file name
    Sequential,
    /// Each scan with those whose mean descriptor is most similar
    Auto,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct MergeArgs {
    /// The output folders of all shards
    #[arg(required = true, value_name = "DIR")]
    pub(crate) parts: Vec<PathBuf>,
    /// Where to write the joined results
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

/// Parses a positive number and multiplies it by the value of its suffix, if it has one.
fn scaled(text: &str, suffixes: &[(&str, f64)]) -> Option<f64> {
    let (number, scale) =
        suffixes.iter().find_map(|(suffix, scale)| Some((text.strip_suffix(suffix)?, *scale))).unwrap_or((text, 1.0));
    number.trim().parse::<f64>().ok().map(|value| value * scale).filter(|value| value.is_finite() && *value > 0.0)
}

pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let seconds = scaled(text, &[("s", 1.0), ("m", 60.0), ("h", 3600.0)]);
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "write a time above zero, e.g. 90s, 5m or 1h".to_owned())
}

pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let scale = |power: i32| 1024f64.powi(power);
    let size = scaled(text, &[("K", scale(1)), ("M", scale(2)), ("G", scale(3)), ("T", scale(4))]);
    size.map(|size| size as u64).ok_or_else(|| "write a size above zero, e.g. 500M or 4G".to_owned())
}
