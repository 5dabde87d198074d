//! The rows of a calibration on disk: written as they are made, and found again after an interruption.

use crate::journal::{Journal, read_rows};
use anyhow::{Context, Result};
use congruent_evaluation::calibration::CalibrationRow;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const FILE: &str = "rows.jsonl";

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    /// Fingerprint of the version, configuration and seed that produced the row.
    made_by: String,
    #[serde(flatten)]
    row: CalibrationRow,
}

/// Rows by the names of their pairs. Rows that another version, configuration or seed produced stay in the file but are
/// ignored.
pub(super) struct Rows {
    made_by: String,
    rows: BTreeMap<String, CalibrationRow>,
    journal: Journal,
}

impl Rows {
    /// Opens the rows of a directory to add more; `made_by` identifies everything that a row depends on besides its
    /// pair.
    pub(super) fn open(directory: &Path, made_by: String) -> Result<Rows> {
        std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot be created", directory.display()))?;
        let path = directory.join(FILE);
        let lines: Vec<Line> = if path.exists() { read_rows(&path)? } else { Vec::new() };
        let journal = Journal::begin(&path, &lines, "run it again")?;
        let ours = lines.into_iter().filter(|line| line.made_by == made_by);
        let rows = ours.map(|line| (line.row.id.clone(), line.row)).collect();
        Ok(Rows { made_by, rows, journal })
    }

    pub(super) fn has(&self, id: &str) -> bool {
        self.rows.contains_key(id)
    }

    /// Returns the rows of these pairs, as far as they exist.
    pub(super) fn of<'i>(&self, ids: impl Iterator<Item = &'i str>) -> Vec<CalibrationRow> {
        ids.filter_map(|id| self.rows.get(id).cloned()).collect()
    }

    /// Adds a row, first to the file.
    pub(super) fn add(&mut self, row: CalibrationRow) -> Result<()> {
        let line = Line { made_by: self.made_by.clone(), row };
        self.journal.append(&line)?;
        self.rows.insert(line.row.id.clone(), line.row);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_evaluation::calibration::Origin;

    #[test]
    fn a_row_of_another_configuration_is_made_again_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let open = |made_by: &str| Rows::open(folder.path(), made_by.to_owned()).unwrap();
        let row = |id: &str| CalibrationRow {
            id: id.to_owned(),
            groups: vec![String::new()],
            origin: Origin::Listed,
            attempts: Vec::new(),
        };
        open("one").add(row("a")).unwrap();
        let mut other = open("another");
        assert!(!other.has("a"));
        other.add(row("a")).unwrap();
        other.add(row("b")).unwrap();
        let one = open("one");
        assert!(one.has("a") && !one.has("b"));
        assert_eq!(open("another").of(["b", "c"].into_iter()).len(), 1, "only pairs that are asked for and there");
    }
}
