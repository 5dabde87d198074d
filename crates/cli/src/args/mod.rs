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
pub(crate) use calibrate::{Alike, CalibrateArgs};
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
    after_help = "Exit codes: 0 success; 1 not registered (the verdict says why), or some pairs or scans have no result; \
                  2 bad input or configuration; 130 interrupted."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find the pose that maps SOURCE into the frame of TARGET
    Align(AlignArgs),
    /// Refine a rough pose, and say whether to trust it; no search
    ///
    /// Poses up to 15 pr off are corrected, from coarse to fine. The verdict is that of align, from the surfaces and from
    /// how many of their correspondences agree; it is never ambiguous, because no other pose is examined.
    Refine(RefineArgs),
    /// Register many pairs of scans: a folder, a table of pairs, or a data set (JSONL and CSV, one row per pair)
    ///
    /// INPUT is a folder of scans, a table of pairs (CSV, JSONL or, if built in, Parquet: source,target and optionally
    /// id, the true pose and an initial pose), a folder with pairs.csv and scans/, or a dataset.toml. Each scan is
    /// described once, with one working length for all of them (the median of what the scans would have alone). A scan
    /// that cannot be used, or a pair that is given up, becomes a row with an error; the others continue. Exit code 1
    /// means that there are such rows, or that a part of a data set's ground truth could not be used. A congruent.toml in
    /// the folder is used.
    Batch(BatchArgs),
    /// Join the parts of a batch that was run with --shard
    Merge(MergeArgs),
    /// Put all scans of a folder into one frame: poses, a merged cloud, a report
    ///
    /// The pairs are registered as by batch. Loops of three and a robust pose graph separate right poses from wrong ones,
    /// then all scans that touch are refined together. Scans that nothing connects remain separate: each component has
    /// its own frame, that of its first scan. Exit code 1 means several components, scans that could not be placed, or
    /// scans that contradict each other under their poses.
    Reconstruct(ReconstructArgs),
    /// Find the points of SCAN that are worth describing (CSV)
    ///
    /// A single scan has no partner, so pr is its own resolution, not the mean of two. To match a pair, give pr with
    /// --resolution and the grid with --set sampling.voxel-grid.leaf=1.2u.
    Keypoints(KeypointsArgs),
    /// Describe SCAN around its keypoints (.npy, and .csv with the position of each row)
    ///
    /// A single scan has no partner, so pr is its own resolution, not the mean of two. To match a pair, give pr with
    /// --resolution and the grid with --set sampling.voxel-grid.leaf=1.2u.
    Describe(DescribeArgs),
    /// Match the descriptors of two scans (CSV, best first)
    Match(MatchArgs),
    /// Estimate the pose from a file of correspondences
    ///
    /// Finds the best pose by the metric, and tests whether it has more inliers than chance explains. The steps of align
    /// that use the whole surfaces (ranking, refinement, escalation) are not performed.
    Estimate(EstimateArgs),
    /// Register all pairs of a data set and compare with the ground truth
    ///
    /// A DATASET is a folder with pairs.csv and scans/, a folder with a dataset.toml, or such a file. A stopped run
    /// resumes: pairs that the directory already has for the same configuration are skipped. Exit code 1 means that some
    /// pair had a file or a ground truth that could not be used.
    Evaluate(EvaluateArgs),
    /// Run experiments of the paper on data sets
    ///
    /// All metrics and thresholds rank the same stream of hypotheses. Experiments: inliers (figure 5), iterations (figure
    /// 6), estimators (table 2), thresholds (figure 7), threshold-rmse (figure 8), threshold-iterations (figure 9), metrics
    /// (figure 10), nuisances and variants (figures 12 and 13), time (figure 14); all runs them together and shares their
    /// work. claims.md says which of the paper's claims hold. The preset is paper, if no configuration is given; of a
    /// configuration, seed, sampling, normals, detector, support, descriptor, frame and matcher are read. Exit code 1 means
    /// that some pair was left out.
    Experiment(ExperimentArgs),
    /// Measure how far the confidence can be trusted, and fit its coefficients
    ///
    /// Registers the pairs of the data sets (as provided, moved, mirrored, and those that are not listed because they
    /// share too little), pairs of scans from different data sets, and simulated ones, among them shapes that do not
    /// determine the pose. Writes the coefficients for [verdict.dense.calibration], and cross-validated figures. A
    /// stopped run resumes.
    Calibrate(CalibrateArgs),
    /// Make a data set with exact ground truth
    Simulate(SimulateArgs),
    /// Describe a scan file
    Inspect(InspectArgs),
    /// Convert a scan to another format
    Convert(ConvertArgs),
    /// Show or check a configuration
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Scan a built-in shape from two sides, register the two scans, and compare with the ground truth
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
    /// Change one setting, e.g. metric.mse.threshold=5pr or metric=inlier-count; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Seed of all random draws (the same seed gives the same result), at most 2^63 - 1
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: Option<u64>,
    /// Number of threads; all processors if not given. The result does not depend on it
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}
