//! `inspect` and `convert`: single scan files.

use super::stages::data_units;
use clap::Args as ClapArgs;
use std::path::PathBuf;

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
    /// The file to be written; its extension chooses the format
    #[arg(value_name = "B")]
    pub(crate) to: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}

/// How scan files are read.
#[derive(Clone, Copy, Debug, Default, ClapArgs)]
pub(crate) struct ReadingArgs {
    /// Keep one point per cell of this side while reading, for files larger than the memory, in data units (0.05u)
    #[arg(long, value_name = "LENGTH", value_parser = data_units)]
    pub(crate) thin: Option<f64>,
}
