//! `reconstruct`: many scans into one frame.

use super::batch::{bytes, duration};
use super::stages::data_units;
use super::{BatchArgs, PairChoice, ReadingArgs, RunArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, ClapArgs)]
pub(crate) struct ReconstructArgs {
    /// A folder of scans, or a folder with scans/
    pub(crate) folder: PathBuf,
    /// Where to write poses.csv, an .xf file per scan, graph.g2o, model-1.ply …, report.html, and the rows of the pairs
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Which pairs to register; if not given, all for up to 40 scans, otherwise auto
    #[arg(long, value_name = "CHOICE")]
    pub(crate) pairs: Option<PairChoice>,
    /// For --pairs auto: number of most similar scans to pair each scan with [default: 8]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    neighbors: Option<u32>,
    /// Thin the merged clouds to one point per cell of this side, in data units (0.5u)
    #[arg(long, value_name = "LENGTH", value_parser = data_units)]
    pub(crate) voxel: Option<f64>,
    /// Print the result as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Continue a stopped run: pairs with a verdict are kept, the others are repeated
    #[arg(long)]
    resume: bool,
    /// Give up pairs that take longer, in seconds or as 90s, 5m, 1h. Checked between stages
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time_limit: Option<Duration>,
    /// Approximate memory for running pairs and cached descriptors, in bytes or as 500M, 4G
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
