//! The rows of a calibration on disk: written as they come, found again after an interruption.

use anyhow::{Context, Result};
use congruent_evaluation::calibration::CalibrationRow;
use congruent_io::write_file;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

const FILE: &str = "rows.jsonl";

pub(super) struct Rows {
    rows: Vec<CalibrationRow>,
    ids: BTreeSet<String>,
    file: File,
}

impl Rows {
    /// The rows of a directory, ready for more; a last line that was cut off is left out.
    pub(super) fn open(directory: &Path) -> Result<Rows> {
        std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot be created", directory.display()))?;
        let path = directory.join(FILE);
        let text = if path.exists() {
            std::fs::read_to_string(&path).with_context(|| path.display().to_string())?
        } else {
            String::new()
        };
        let lines: Vec<&str> = text.lines().collect();
        let mut rows: Vec<CalibrationRow> = Vec::with_capacity(lines.len());
        for (number, line) in (1..).zip(&lines) {
            match serde_json::from_str(line) {
                Ok(row) => rows.push(row),
                Err(_) if number == lines.len() => {}
                Err(error) => {
                    return Err(error).with_context(|| {
                        format!("{}: line {number} is no row; remove it or choose another directory", path.display())
                    });
                }
            }
        }
        let whole: String = rows.iter().map(|row| json(row) + "\n").collect();
        write_file(&path, whole.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&path).with_context(|| path.display().to_string())?;
        Ok(Rows { ids: rows.iter().map(|row| row.id.clone()).collect(), rows, file })
    }

    pub(super) fn all(&self) -> &[CalibrationRow] {
        &self.rows
    }

    pub(super) fn has(&self, id: &str) -> bool {
        self.ids.contains(id)
    }

    /// Adds a row, on disk first.
    pub(super) fn add(&mut self, row: CalibrationRow) -> Result<()> {
        writeln!(self.file, "{}", json(&row)).context("a row cannot be written; check that the disk has room")?;
        self.ids.insert(row.id.clone());
        self.rows.push(row);
        Ok(())
    }
}

fn json(row: &CalibrationRow) -> String {
    serde_json::to_string(row).expect("numbers and strings can be written as JSON")
}
