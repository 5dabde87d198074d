//! Writes pages and figures about many pairs.

use crate::args::PageArgs;
use crate::outputs;
use anyhow::Result;
use congruent_io::write_file;
use congruent_report::{Figure, Page};
use std::path::{Path, PathBuf};

impl PageArgs {
    /// Refuses a page that could not be written or would replace something, and makes the folder of the figures.
    /// `results` are the other files that the command writes.
    pub(super) fn check(&self, inputs: &[&Path], results: &[PathBuf]) -> Result<()> {
        self.figures.as_deref().map_or(Ok(()), outputs::create_folder)?;
        let wanted: Vec<&Path> = results.iter().chain(&self.report).map(PathBuf::as_path).collect();
        outputs::check(inputs, &wanted)
    }
}

/// Makes and writes what was asked for.
pub(super) fn write_pages(
    args: &PageArgs,
    page: impl FnOnce() -> Page,
    figures: impl FnOnce() -> Vec<Figure>,
) -> Result<()> {
    if let Some(path) = &args.report {
        write_file(path, page().html().as_bytes())?;
    }
    if let Some(directory) = &args.figures {
        for figure in figures() {
            write_file(&directory.join(format!("{}.svg", figure.name)), figure.svg.as_bytes())?;
        }
    }
    Ok(())
}
