//! `reconstruct`: many scans into one frame.

use super::batch::{bytes, duration};
use super::stages::data_units;
use super::{BatchArgs, PairChoice, ReadingArgs, RunArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, ClapArgs)]
pub(crate) struct ReconstructArgs {
    /// A folder of scans, or one with scans/
    pub(crate) folder: PathBuf,
    /// Where to write poses.csv, an .xf for each scan, graph.g2o, model-1.ply …, report.html, and the rows of the pairs
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Which pairs are registered; all of up to 40 scans, else auto
    #[arg(long, value_name = "CHOICE")]
    pub(crate) pairs: Option<PairChoice>,
    /// For --pairs auto: with how many of the most similar scans each one is paired [default: 8]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    neighbors: Option<u32>,
    /// Thin the merged clouds with cells of this side, in data units (0.5u)
    #[arg(long, value_name = "LENGTH", value_parser = data_units)]
    pub(crate) voxel: Option<f64>,
    /// Print the result as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Go on with a run that was stopped; pairs that are there are kept
    #[arg(long)]
    resume: bool,
    /// Give a pair up that takes longer, in seconds or as 90s, 5m, 1h
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time_limit: Option<Duration>,
    /// Memory for running pairs and remembered descriptors, about; in bytes or as 500M, 4G
    #[arg(long, value_name = "SIZE", default_value = "1G", value_parser = bytes)]
    memory: u64,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

impl ReconstructArgs {
    /// Returns the arguments of the batch that registers the pairs.
    pub(crate) fn batch(&self, pairs: PairChoice) -> BatchArgs {
        BatchArgs {
            input: self.folder.clone(),
            output: self.output.clone(),
            pairs: Some(pairs),
            sequential: false,
            neighbors: self.neighbors,
            data: None,
            resume: self.resume,
            shard: "1/1".parse().expect("the whole is a share"),
            time_limit: self.time_limit,
            memory: self.memory,
            reading: self.reading,
            run: self.run.clone(),
        }
    }
}
