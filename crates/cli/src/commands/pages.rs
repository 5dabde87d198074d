//! Writes pages and figures about many pairs.

use crate::args::PageArgs;
use anyhow::{Context, Result};
use congruent_io::write_file;
use congruent_report::{Figure, Page};

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
        std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot be created", directory.display()))?;
        for figure in figures() {
            write_file(&directory.join(format!("{}.svg", figure.name)), figure.svg.as_bytes())?;
        }
    }
    Ok(())
}
