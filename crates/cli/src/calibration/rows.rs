//! The rows of a calibration on disk: written as they are made, and found again after an interruption.

use super::Trial;
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
    /// Fingerprint of the version and of the settings on which the row depends.
    made_by: String,
    #[serde(flatten)]
    row: CalibrationRow,
}

/// Rows by the names of their pairs. Rows that another version or other settings produced stay in the file but are
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

    /// Returns the rows of these trials, as far as they exist. What a pair shows and where it comes from is what the trial
    /// says: what the file says may be from a run in which other data sets were alike.
    pub(super) fn of(&self, trials: &[Trial<'_>]) -> Vec<CalibrationRow> {
        let row = |trial: &Trial<'_>| {
            let row = self.rows.get(&trial.id)?.clone();
            Some(CalibrationRow { groups: trial.groups.clone(), origin: trial.origin, ..row })
        };
        trials.iter().filter_map(row).collect()
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
    use anyhow::bail;
    use congruent_evaluation::calibration::Origin;

    fn row(id: &str) -> CalibrationRow {
        CalibrationRow {
            id: id.to_owned(),
            groups: vec!["once".to_owned()],
            origin: Origin::Listed,
            attempts: Vec::new(),
        }
    }

    fn trial(id: &str) -> Trial<'static> {
        let groups = vec!["now".to_owned()];
        Trial { id: id.to_owned(), groups, origin: Origin::Crossed, scene: Box::new(|| bail!("not needed")) }
    }

    #[test]
    fn groups_are_those_of_this_run() {
        let folder = tempfile::tempdir().unwrap();
        let mut rows = Rows::open(folder.path(), "one".to_owned()).unwrap();
        rows.add(row("a")).unwrap();
        let found = rows.of(&[trial("a"), trial("b")]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].groups[0].as_str(), found[0].origin), ("now", Origin::Crossed));
    }

    #[test]
    fn a_row_of_another_configuration_is_made_again_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let open = |made_by: &str| Rows::open(folder.path(), made_by.to_owned()).unwrap();
        open("one").add(row("a")).unwrap();
        {
            let mut other = open("another");
            assert!(!other.has("a"));
            other.add(row("a")).unwrap();
            other.add(row("b")).unwrap();
        }
        {
            let one = open("one");
            assert!(one.has("a") && !one.has("b"));
        }
        assert_eq!(open("another").of(&[trial("b"), trial("c")]).len(), 1, "only pairs that are asked for and there");
    }
}
