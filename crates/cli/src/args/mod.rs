//! The command line.

mod align;
mod batch;
mod calibrate;
mod config;
mod evaluation;
mod files;
mod prior;
mod reconstruct;
mod stages;

pub(crate) use align::{AlignArgs, DemoArgs, RefineArgs, ResultArgs, ViewpointArgs};
pub(crate) use batch::{BatchArgs, MergeArgs, PairChoice};
pub(crate) use calibrate::CalibrateArgs;
pub(crate) use config::ConfigCommand;
pub(crate) use evaluation::{DatasetArgs, EvaluateArgs, ExperimentArgs, PageArgs, SimulateArgs, SimulatedKind};
pub(crate) use files::{ConvertArgs, InspectArgs, ReadingArgs};
pub(crate) use prior::{LevelArgs, PriorArgs};
pub(crate) use reconstruct::ReconstructArgs;
pub(crate) use stages::{DescribeArgs, EstimateArgs, KeypointsArgs, MatchArgs, StageArgs};

use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;

/// Registers raw 3D scans: two meshes or point clouds in, the pose that aligns them out.
#[derive(Debug, Parser)]
#[command(
    name = "congruent",
    version,
    // Lines are never wrapped, whichever features of clap other crates enable.
    term_width = 0,
    after_help = "Exit codes: 0 done, 1 not registered (the verdict says why), 2 bad input or configuration, 130 interrupted."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find the pose that maps SOURCE into the frame of TARGET
    Align(AlignArgs),
    /// Make a rough pose exact, and say whether to believe it; nothing is searched for
    ///
    /// The pose is drawn in from up to 15 pr, from coarse to fine. The verdict is that of align, from the surfaces and from
    /// how many of their correspondences agree; it is never ambiguous, because no other pose is looked at.
    Refine(RefineArgs),
    /// Register many pairs of scans: a folder, a table of pairs, or a dataset (JSONL and CSV, one row a pair)
    ///
    /// INPUT is a folder of scans, a table of pairs (CSV, JSONL or, if built in, Parquet: source,target and optionally id and
    /// the true pose), a folder with pairs.csv and scans/, or a dataset.toml. Each scan is described once, with one working length for all of them (the median of
    /// what the scans would have alone). A scan that cannot be used, or a pair that is given up, is a row with an error; the
    /// rest goes on. Exit code 1 says that there are such rows. A congruent.toml in the folder is used.
    Batch(BatchArgs),
    /// Join the parts of a batch that was run with --shard
    Merge(MergeArgs),
    /// Put all scans of a folder into one frame: poses, a merged cloud, a report
    ///
    /// The pairs are registered as by batch. Loops of three and a robust pose graph tell right pairs from wrong ones, then all
    /// scans that touch are refined together. Scans that nothing holds together stay apart: each component has a frame of its
    /// own, that of its first scan. Exit code 1 says that there are several, or scans without a place.
    Reconstruct(ReconstructArgs),
    /// Find the points of SCAN that are worth describing (CSV)
    ///
    /// One scan has no partner: pr is its own resolution here, not the mean of two. --resolution says what pr is, and
    /// --set sampling.voxel-grid.leaf=1.2u how the scan is thinned, where it must be as in a pair.
    Keypoints(KeypointsArgs),
    /// Describe SCAN around its keypoints (.npy, and .csv with the place of each row)
    ///
    /// One scan has no partner: pr is its own resolution here, not the mean of two. --resolution says what pr is, and
    /// --set sampling.voxel-grid.leaf=1.2u how the scan is thinned, where it must be as in a pair.
    Describe(DescribeArgs),
    /// Match the descriptors of two scans (CSV, best first)
    Match(MatchArgs),
    /// Estimate the pose from a file of correspondences
    ///
    /// The best pose by the metric, and whether it has more inliers than chance explains. What align does with the whole
    /// surfaces (ranking, refinement, escalation) is not done here.
    Estimate(EstimateArgs),
    /// Register all pairs of a data set and compare with the truth
    ///
    /// A DATASET is a folder with pairs.csv and scans/, a folder with a dataset.toml, or such a file. A killed run
    /// resumes where it was: pairs that the directory already has for the same configuration are skipped. Exit code 1
    /// says that some pair had a file or a truth that could not be used.
    Evaluate(EvaluateArgs),
    /// Run experiments of the paper on data sets
    ///
    /// All metrics and thresholds rank the same stream of hypotheses. Experiments: inliers (figure 5), iterations (figure
    /// 6), estimators (table 2), thresholds (figure 7), threshold-rmse (figure 8), threshold-iterations (figure 9), metrics
    /// (figure 10), nuisances and variants (figures 12 and 13), time (figure 14); all runs them together and shares their
    /// work. claims.md says which of the paper's claims hold. The chain is the preset paper, if no other is named. Exit code
    /// 1 says that some pair was left out.
    Experiment(ExperimentArgs),
    /// Measure how far the confidence can be trusted, and fit its coefficients
    ///
    /// Registers the pairs of the data sets (as they came, moved, mirrored, and those that are not listed because they
    /// share too little), pairs of scans of different data sets, and simulated ones, among them shapes that leave the pose open. Writes
    /// the coefficients for [verdict.dense.calibration], and cross-validated figures. A killed run resumes where it was.
    Calibrate(CalibrateArgs),
    /// Make a data set with exact truth
    Simulate(SimulateArgs),
    /// Say what a scan file holds
    Inspect(InspectArgs),
    /// Write a scan in another format
    Convert(ConvertArgs),
    /// Show or check a configuration
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Scan a built-in shape from two sides, register the two scans, and compare with the truth
    Demo(DemoArgs),
}

impl Command {
    /// Returns the number of threads that was asked for, if the command has that option.
    pub(crate) fn threads(&self) -> Option<u16> {
        let run = match self {
            Command::Align(args) => &args.run,
            Command::Refine(args) => &args.run,
            Command::Batch(args) => &args.run,
            Command::Reconstruct(args) => &args.run,
            Command::Keypoints(args) => &args.stage.run,
            Command::Describe(args) => &args.stage.run,
            Command::Match(args) => &args.run,
            Command::Estimate(args) => &args.stage.run,
            Command::Evaluate(args) => &args.run,
            Command::Experiment(args) => &args.run,
            Command::Calibrate(args) => &args.run,
            Command::Demo(args) => &args.run,
            Command::Merge(_)
            | Command::Simulate(_)
            | Command::Inspect(_)
            | Command::Convert(_)
            | Command::Config(_) => return None,
        };
        run.threads
    }
}

/// What every command that registers takes.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct RunArgs {
    /// A TOML file, or the name of a preset (default, fast, paper)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Change one setting, for instance metric.mse.threshold=5pr or metric=inlier-count; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Seed of all random draws (the same seed gives the same result); as large as a number in TOML can be
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: Option<u64>,
    /// Threads to use; all processors if not given. The result does not depend on it
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}
