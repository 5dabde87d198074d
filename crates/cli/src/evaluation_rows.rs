//! The rows of an evaluation on disk: written as they are made, and found again after an interruption.

use crate::journal::{Journal, read_rows};
use crate::outputs::create_folder;
use anyhow::{Context, Result};
use congruent_evaluation::{PairRow, Status};
use congruent_io::csv_line;
use std::path::{Path, PathBuf};

/// Not `pairs.csv`: that is the ground truth of a data set, and results may be written beside it.
const JSONL: &str = "results.jsonl";
const CSV: &str = "results.csv";

/// The content of `results.jsonl`.
pub(crate) struct EvaluationRows {
    rows: Vec<PairRow>,
    journal: Journal,
}

impl EvaluationRows {
    /// Opens the rows of a directory to add rows of a configuration. Rows of this configuration with an error are
    /// removed, so that their pairs are tried again.
    pub(crate) fn open(directory: &Path, configuration: &str) -> Result<EvaluationRows> {
        create_folder(directory)?;
        let path = directory.join(JSONL);
        let mut rows: Vec<PairRow> = if path.exists() { read_rows(&path)? } else { Vec::new() };
        rows.retain(|row| row.configuration != configuration || row.status != Status::Error);
        let journal = Journal::begin(&path, &rows, "run it again")?;
        Ok(EvaluationRows { rows, journal })
    }

    /// Returns the files that it writes.
    pub(crate) fn files(directory: &Path) -> [PathBuf; 2] {
        [JSONL, CSV].map(|name| directory.join(name))
    }

    /// Reads the rows of a directory.
    pub(crate) fn read(directory: &Path) -> Result<Vec<PairRow>> {
        read_rows(&directory.join(JSONL)).context("give a directory that `congruent evaluate -o` has written")
    }

    pub(crate) fn all(&self) -> &[PairRow] {
        &self.rows
    }

    pub(crate) fn find(&self, configuration: &str, pair: &str) -> Option<&PairRow> {
        self.rows.iter().find(|row| row.configuration == configuration && row.pair == pair)
    }

    /// Adds a row, first to the file.
    pub(crate) fn add(&mut self, row: PairRow) -> Result<()> {
        self.journal.append(&row)?;
        self.rows.push(row);
        Ok(())
    }

    /// Writes all rows as `results.csv`, for other programs.
    pub(crate) fn write_table(&self, directory: &Path) -> Result<()> {
        let rows: String = self.rows.iter().map(|row| row.csv() + "\n").collect();
        let table = csv_line(PairRow::COLUMNS) + "\n" + &rows;
        Ok(congruent_io::write_file(&directory.join(CSV), table.as_bytes())?)
    }
}
