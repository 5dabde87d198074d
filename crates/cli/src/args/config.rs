//! `config`: settings.

use clap::Subcommand;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Print a preset with explanations, or every member of every family
    Show {
        /// default, fast, paper, or members
        #[arg(default_value = "default")]
        preset: String,
        /// Print every setting and where it comes from: defaults < preset < folder < file < --set
        #[arg(long)]
        explain: bool,
        /// A folder whose congruent.toml is included, as in batch
        #[arg(long, value_name = "DIR", requires = "explain")]
        folder: Option<PathBuf>,
        /// A TOML file, or the name of a preset (default, fast, paper)
        #[arg(short, long, value_name = "FILE", requires = "explain")]
        config: Option<PathBuf>,
        /// Change one setting; may be repeated
        #[arg(long, value_name = "KEY=VALUE", requires = "explain")]
        set: Vec<String>,
        /// Seed of all random draws, at most 2^63 - 1
        #[arg(long, requires = "explain", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
        seed: Option<u64>,
    },
    /// Check a configuration file
    Check {
        /// The file
        file: PathBuf,
    },
}
