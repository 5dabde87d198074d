//! The command line.

use crate::batch::Share;
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use congruent_geometry::Length;
use std::path::PathBuf;
use std::time::Duration;

/// Registers raw 3D scans: two meshes or point clouds in, the pose that aligns them out.
#[derive(Debug, Parser)]
#[command(
    name = "congruent",
    version,
    about,
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
    /// Register many pairs of scans: a folder, a table of pairs, or a dataset (JSONL and CSV, one row a pair)
    ///
    /// INPUT is a folder of scans, a table of pairs (CSV or JSONL: source,target and optionally id and the true pose), or a
    /// folder with pairs.csv and scans/. Each scan is described once, with one working length for all of them (the median of
    /// what the scans would have alone). A scan that cannot be used, or a pair that is given up, is a row with an error; the
    /// rest goes on. Exit code 1 says that there are such rows. A congruent.toml in the folder is used.
    Batch(BatchArgs),
    /// Join the parts of a batch that was run with --shard
    Merge(MergeArgs),
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
    /// DATASET is a folder with pairs.csv and scans/, a folder with a dataset.toml, or such a file. A killed run
    /// resumes where it was: pairs that the directory already has for the same configuration are skipped. Exit code 1
    /// says that some pair had a file that could not be used.
    Evaluate(EvaluateArgs),
    /// Run an experiment of the paper on a data set
    ///
    /// All metrics and thresholds rank the same stream of hypotheses. Experiments: iterations (figure 6), estimators
    /// (table 2), thresholds (figure 7), threshold-rmse (figure 8), metrics (figure 10), nuisances and variants
    /// (figures 12 and 13), time (figure 14). The chain is the preset paper, if no other is named.
    Experiment(ExperimentArgs),
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
    /// Write what each stage left into DIR: keypoints, descriptors, matches, poses (docs/FILES.md)
    #[arg(long, value_name = "DIR")]
    pub(crate) save_stages: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct BatchArgs {
    /// A folder of scans, a table of pairs (.csv, .jsonl), or a folder with pairs.csv and scans/
    pub(crate) input: PathBuf,
    /// Where to write results.jsonl, results.csv, run.json and configuration.toml
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Which pairs of a folder; all, or those of its pairs.csv, if not given
    #[arg(long, value_name = "CHOICE", conflicts_with = "sequential")]
    pub(crate) pairs: Option<PairChoice>,
    /// Pair each scan with the one before it, by file name (the same as --pairs sequential)
    #[arg(long)]
    pub(crate) sequential: bool,
    /// For --pairs auto: with how many of the most similar scans each one is paired
    #[arg(long, value_name = "K", default_value = "8")]
    pub(crate) neighbors: usize,
    /// Go on with a run that was stopped; rows that are there are kept
    #[arg(long)]
    pub(crate) resume: bool,
    /// Do the i-th of n parts of the pairs; merge joins the parts. The rows do not depend on it
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(crate) shard: Share,
    /// Give a pair up that takes longer, in seconds or as 90s, 5m, 1h. Looked at between stages: none is interrupted
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time_limit: Option<Duration>,
    /// Memory for running pairs and remembered descriptors, about; in bytes or as 500M, 4G
    #[arg(long, value_name = "SIZE", default_value = "1G", value_parser = bytes)]
    pub(crate) memory: u64,
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
    /// Each scan with each other one
    All,
    /// Each scan with the one before it, by file name
    Sequential,
    /// Each scan with those whose mean descriptor is most like its own
    Auto,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct MergeArgs {
    /// The output folders of all shards
    #[arg(required = true, value_name = "DIR")]
    pub(crate) parts: Vec<PathBuf>,
    /// Where to write the whole
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

/// A number with one of the suffixes, times what it stands for.
fn scaled(text: &str, suffixes: &[(&str, f64)]) -> Option<f64> {
    let (number, scale) =
        suffixes.iter().find_map(|(suffix, scale)| Some((text.strip_suffix(suffix)?, *scale))).unwrap_or((text, 1.0));
    number.trim().parse::<f64>().ok().map(|value| value * scale).filter(|value| value.is_finite() && *value > 0.0)
}

fn duration(text: &str) -> Result<Duration, String> {
    let seconds = scaled(text, &[("s", 1.0), ("m", 60.0), ("h", 3600.0)]);
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "write a time above zero, as in 90s, 5m or 1h".to_owned())
}

fn bytes(text: &str) -> Result<u64, String> {
    let scale = |power: i32| 1024f64.powi(power);
    let size = scaled(text, &[("K", scale(1)), ("M", scale(2)), ("G", scale(3)), ("T", scale(4))]);
    size.map(|size| size as u64).ok_or_else(|| "write a size above zero, as in 500M or 4G".to_owned())
}

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
    /// Describe these places (columns x,y,z) and not those that the configured detector finds
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) keypoints: Option<PathBuf>,
    /// Where to write the matrix; the places of its rows go beside it, into the same name with .csv
    #[arg(short, long, value_name = "FILE.npy")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct MatchArgs {
    /// Descriptors of the source, with the places of the rows beside them in .csv
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
    /// Correspondences, best first: CSV of `congruent match`, lines `sx sy sz tx ty tz`, or pairs of point positions
    pub(crate) matches: PathBuf,
    /// The scan to be moved; for pairs of positions, and for all that needs the surfaces
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
    /// What pr means after sampling, in data units (0.6u); that of the named scans if not given
    #[arg(long, value_name = "LENGTH", value_parser = data_units)]
    pub(crate) resolution: Option<f64>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// A length that does not need a resolution.
fn data_units(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(Length::Units(units)) => Ok(units),
        Ok(Length::Resolutions(_)) => Err("pr is what this option settles; write data units, as in 0.6u".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// What every command that registers takes.
#[derive(Debug, Default, ClapArgs)]
pub(crate) struct RunArgs {
    /// A TOML file, or the name of a preset (default, fast, paper)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Change one setting, for instance metric.mse.threshold=5pr or metric=inlier-count; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Seed of all random draws (the same seed gives the same result)
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Threads to use; all processors if not given. The result does not depend on it
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}

/// Which pairs a batch works on.
#[derive(Debug, ClapArgs)]
pub(crate) struct DatasetArgs {
    /// A folder, or a dataset.toml
    pub(crate) dataset: PathBuf,
    /// Where the files of the data set are, if not beside its description
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// At most N pairs, evenly from all over the list
    #[arg(long, value_name = "N")]
    pub(crate) pairs: Option<usize>,
    /// Only pairs whose scans share at least this much of their points, 0 to 1
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    pub(crate) min_overlap: f64,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct EvaluateArgs {
    #[command(flatten)]
    pub(crate) dataset: DatasetArgs,
    /// Where to write pairs.csv, pairs.jsonl, config.toml and summary.txt
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Compare with an earlier evaluation of the same pairs (McNemar's exact test)
    #[arg(long, value_name = "DIR")]
    pub(crate) compare: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct ExperimentArgs {
    /// Name of an experiment, all, or a TOML file
    pub(crate) experiment: String,
    #[command(flatten)]
    pub(crate) dataset: DatasetArgs,
    /// Where to write NAME.md, NAME.csv and NAME-pairs.csv
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct SimulateArgs {
    /// Which data set to resemble
    pub(crate) kind: SimulatedKind,
    /// Where to write scans/, pairs.csv and dataset.toml
    pub(crate) directory: PathBuf,
    /// How many pairs
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) pairs: usize,
    /// The same seed gives the same data
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SimulatedKind {
    /// Laser scans of one object from all around
    #[value(name = "u3m-like")]
    U3m,
    /// Depth camera images of one object: noise, steps, holes
    #[value(name = "bmr-like")]
    Bmr,
    /// Whole models in cluttered laser scans
    #[value(name = "u3or-like")]
    U3or,
    /// Depth camera images of models in cluttered ones
    #[value(name = "bod5-like")]
    Bod5,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct InspectArgs {
    /// The scan file
    pub(crate) file: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct ConvertArgs {
    /// The scan to be read, recognised by its content: PLY, OBJ, STL, OFF, PCD, XYZ/TXT/CSV, LAS/LAZ or E57
    #[arg(value_name = "A")]
    pub(crate) from: PathBuf,
    /// The file to be written; its extension says which format
    #[arg(value_name = "B")]
    pub(crate) to: PathBuf,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Print a preset with its explanations, or every member of every family
    Show {
        /// default, fast, paper, or members
        #[arg(default_value = "default")]
        preset: String,
        /// Print every setting and where it comes from: defaults < preset < folder < file < --set
        #[arg(long)]
        explain: bool,
        /// A folder whose congruent.toml counts, as in batch
        #[arg(long, value_name = "DIR", requires = "explain")]
        folder: Option<PathBuf>,
        /// A TOML file
        #[arg(short, long, value_name = "FILE", requires = "explain")]
        config: Option<PathBuf>,
        /// Change one setting; may be repeated
        #[arg(long, value_name = "KEY=VALUE", requires = "explain")]
        set: Vec<String>,
        /// Seed of all random draws
        #[arg(long, requires = "explain")]
        seed: Option<u64>,
    },
    /// Check a configuration file
    Check {
        /// The file
        file: PathBuf,
    },
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
