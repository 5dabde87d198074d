//! The command line.

use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;

/// Registers raw 3D scans: two meshes or point clouds in, the pose that aligns them out.
#[derive(Debug, Parser)]
#[command(
    name = "congruent",
    version,
    about,
    after_help = "Exit codes: 0 done, 1 not registered (the verdict says why), 2 bad input or configuration."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find the pose that maps SOURCE into the frame of TARGET
    Align(AlignArgs),
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
    /// Print one JSON object instead of a summary
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the JSON object to FILE; a name ending in .txt or .xf gets the 4x4 matrix alone
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write the source in the target's frame, as PLY (only where the verdict is ok)
    #[arg(long, value_name = "FILE")]
    pub(crate) write_aligned: Option<PathBuf>,
}

/// What every command that registers takes.
#[derive(Debug, Default, ClapArgs)]
pub(crate) struct RunArgs {
    /// A TOML file, or the name of a preset (default, paper)
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
    /// Print a preset with its explanations
    Show {
        /// Which one
        #[arg(default_value = "default")]
        preset: String,
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
