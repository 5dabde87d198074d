//! `evaluate`, `experiment` and `simulate`: pairs with ground truth.

use super::RunArgs;
use clap::{Args as ClapArgs, ValueEnum};
use congruent_evaluation::experiment::Nuisance;
use std::path::PathBuf;

/// Which pairs a batch works on.
#[derive(Debug, ClapArgs)]
pub(crate) struct DatasetArgs {
    /// Folders, or dataset.toml files
    #[arg(required = true, value_name = "DATASET")]
    pub(crate) datasets: Vec<PathBuf>,
    /// Folder with the files of the data set, if not beside its description; once per data set, in the same order
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Vec<PathBuf>,
    /// At most N pairs of each data set, spread evenly over its list
    #[arg(long, value_name = "N")]
    pub(crate) pairs: Option<usize>,
    /// Only pairs whose scans share at least this fraction of their points, 0 to 1; if not given, the data set's minimum
    #[arg(long, value_name = "X", value_parser = fraction)]
    pub(crate) min_overlap: Option<f64>,
}

fn fraction(text: &str) -> Result<f64, String> {
    let fraction: Option<f64> = text.parse().ok();
    fraction.filter(|v| (0.0..=1.0).contains(v)).ok_or_else(|| "write a fraction from 0 to 1, e.g. 0.3".to_owned())
}

/// Parses a nuisance as it is written in the configuration of an experiment.
fn nuisance(text: &str) -> Result<Nuisance, String> {
    #[derive(serde::Deserialize)]
    struct Parsed {
        nuisance: Nuisance,
    }
    if !text.contains('=') && text != "none" {
        return Err("write the kind and the amount, e.g. noise=1".to_owned());
    }
    let parsed = toml::from_str(&format!("nuisance = {{ {text} }}")).map_err(|e| e.message().to_owned());
    parsed.map(|Parsed { nuisance }| nuisance)
}

/// What the results are shown in.
#[derive(Debug, ClapArgs)]
pub(crate) struct PageArgs {
    /// Write a page with figures and tables (one HTML file that needs no network)
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Write each figure as an SVG file
    #[arg(long, value_name = "DIR")]
    pub(crate) figures: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct EvaluateArgs {
    #[command(flatten)]
    pub(crate) dataset: DatasetArgs,
    /// Where to write results.csv, results.jsonl, config.toml and summary.txt
    #[arg(short, long, value_name = "DIR", required_unless_present = "show")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) page: PageArgs,
    /// Register only this pair and write its page to --report: errors of all points against the ground truth, in 3D
    #[arg(long, value_name = "SOURCE,TARGET", requires = "report", conflicts_with_all = ["output", "figures", "compare"])]
    pub(crate) show: Option<String>,
    /// With --show: the same pair with each of these metrics, side by side, e.g. mse,inlier-count,overlapped-points
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "show")]
    pub(crate) metrics: Vec<String>,
    /// Compare with an earlier evaluation of the same pairs (McNemar's exact test)
    #[arg(long, value_name = "DIR")]
    pub(crate) compare: Option<PathBuf>,
    /// Degrade both scans first: noise=1 (standard deviation, pr), strays=0.1 (a tenth as many extra points),
    /// keep-randomly=0.1, keep-evenly=0.1, holes=6; may be repeated, applied in order. Errors refer to the scans as
    /// provided
    #[arg(long, value_name = "NUISANCE", value_parser = nuisance, conflicts_with = "show")]
    pub(crate) spoil: Vec<Nuisance>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct ExperimentArgs {
    /// Name of an experiment, all, or a TOML file
    pub(crate) experiment: String,
    #[command(flatten)]
    pub(crate) dataset: DatasetArgs,
    /// Where to write NAME.md, NAME.csv and NAME-pairs.csv, and claims.md
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) page: PageArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct SimulateArgs {
    /// The data set to resemble
    pub(crate) kind: SimulatedKind,
    /// Where to write scans/, pairs.csv and dataset.toml
    pub(crate) directory: PathBuf,
    /// Number of pairs
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) pairs: usize,
    /// A triangle mesh to scan instead of the built-in figurines; may be repeated
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: Vec<PathBuf>,
    /// Seed of all random draws (the same seed gives the same data)
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
    /// Depth camera images of models, to be found in cluttered ones
    #[value(name = "bod5-like")]
    Bod5,
}
