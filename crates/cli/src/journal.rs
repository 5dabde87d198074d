//! Rows on disk: each is a line of JSON, written as soon as it is made and found again after an interruption.

use anyhow::{Context, Result, anyhow, bail};
use congruent_io::write_file;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file of rows that grows by complete lines.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    /// Length of the complete rows, bytes.
    whole: u64,
    /// How the user continues after a full disk, for the error message.
    way_on: &'static str,
}

impl Journal {
    /// Replaces the content of a file by `rows` and opens it for further rows.
    pub(crate) fn begin<T: Serialize>(path: &Path, rows: &[T], way_on: &'static str) -> Result<Journal> {
        refuse_if_in_use(path)?;
        // This also removes what followed the last complete row, so that the next row begins a line.
        write_rows(path, rows)?;
        let opened = OpenOptions::new().append(true).open(path);
        let opened = opened.and_then(|file| file.metadata().map(|metadata| (file, metadata.len())));
        let (file, whole) = opened.with_context(|| format!("{}: cannot be written", path.display()))?;
        // Where a file system has no locks, two runs are not told apart.
        drop(file.try_lock());
        Ok(Journal { path: path.to_owned(), file, whole, way_on })
    }

    /// Writes one row at once, so that it is kept whatever happens next.
    pub(crate) fn append<T: Serialize>(&mut self, row: &T) -> Result<()> {
        let line = line(row);
        let written = self.file.write_all(line.as_bytes());
        if written.is_err() {
            // A full disk may take a part of the line. It is cut off, so that a shorter row that still fits begins a
            // line.
            drop(self.file.set_len(self.whole));
        }
        written.with_context(|| {
            let way_on = self.way_on;
            format!(
                "{}: cannot be written; free some disk space, then {way_on}; the rows written so far are kept",
                self.path.display()
            )
        })?;
        self.whole += line.len() as u64;
        Ok(())
    }
}

/// Returns an error if another run holds the file open for rows: it would write to a file that is replaced here.
fn refuse_if_in_use(path: &Path) -> Result<()> {
    match File::open(path).map(|file| file.try_lock()) {
        Ok(Err(TryLockError::WouldBlock)) => {
            bail!(
                "{}: another run is writing to it; wait until that has ended, or choose another folder",
                path.display()
            )
        }
        _ => Ok(()),
    }
}

/// Reads all complete rows. A last line that was cut off by a kill is ignored; any other invalid line is an error.
pub(crate) fn read_rows<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    // Only what ends with a line break is complete; the cut may also be inside a character.
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
    let text = String::from_utf8_lossy(&bytes[..whole]);
    let row = |(number, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|error| match number {
            1 => anyhow!(
                "{}: contains results of another command or version ({error}); choose another folder",
                path.display()
            ),
            _ => anyhow!("{}: line {number} is not a row: {error}; remove it", path.display()),
        })
    };
    (1..).zip(text.lines()).map(row).collect()
}

/// Writes a file of rows.
pub(crate) fn write_rows<T: Serialize>(path: &Path, rows: &[T]) -> Result<()> {
    let text: String = rows.iter().map(line).collect();
    Ok(write_file(path, text.as_bytes())?)
}

fn line<T: Serialize>(row: &T) -> String {
    serde_json::to_string(row).expect("numbers, strings and lists can be written as JSON") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_cut_off_is_left_out_and_the_next_row_begins_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.jsonl");
        // The cut is inside a character.
        let mut bytes = "\"a\"\n\"\u{e9}\"\n".as_bytes().to_vec();
        bytes.extend(&"\"\u{e9}".as_bytes()[..2]);
        std::fs::write(&path, &bytes).unwrap();
        let rows: Vec<String> = read_rows(&path).unwrap();
        assert_eq!(rows, ["a", "\u{e9}"]);
        Journal::begin(&path, &rows, "").unwrap().append(&"b").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "\"a\"\n\"\u{e9}\"\n\"b\"\n");
    }

    #[test]
    fn two_runs_do_not_write_to_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.jsonl");
        let first = Journal::begin(&path, &["a"], "").unwrap();
        let refused = Journal::begin(&path, &["b"], "").err().unwrap().to_string();
        assert!(refused.contains("rows.jsonl: another run is writing to it"), "{refused}");
        drop(first);
        assert!(Journal::begin(&path, &["b"], "").is_ok());
    }

    #[test]
    fn a_bad_line_that_is_not_the_last_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.jsonl");
        std::fs::write(&path, "\"a\"\nnonsense\n\"b\"\n").unwrap();
        let message = read_rows::<String>(&path).unwrap_err().to_string();
        assert!(message.contains("rows.jsonl: line 2 is not a row") && message.contains("remove it"), "{message}");
    }
}
