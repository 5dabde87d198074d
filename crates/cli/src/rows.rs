//! The rows of a batch on disk: written as they come, found again after an interruption.

use anyhow::{Context, Result};
use congruent_evaluation::{PairRow, Status, csv_line};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

const JSONL: &str = "pairs.jsonl";
const CSV: &str = "pairs.csv";

/// What `pairs.jsonl` holds, and `pairs.csv` beside it for other programs.
pub(crate) struct Rows {
    rows: Vec<PairRow>,
    /// Open for more; none where the rows are only read.
    files: Option<[File; 2]>,
}

impl Rows {
    /// The rows of a directory, ready for more. Rows with an error are left out, so that their pairs are tried again,
    /// and so is a last line that was cut off.
    pub(crate) fn open(directory: &Path) -> Result<Rows> {
        std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot be created", directory.display()))?;
        let mut rows = if directory.join(JSONL).exists() { Rows::read(directory)?.rows } else { Vec::new() };
        rows.retain(|row| row.status != Status::Error);
        let json: String = rows.iter().map(|row| json(row) + "\n").collect();
        let csv: String = rows.iter().map(|row| row.csv() + "\n").collect();
        let csv = csv_line(PairRow::COLUMNS) + "\n" + &csv;
        let file = |name: &str, text: &str| -> Result<File> {
            let path = directory.join(name);
            congruent_io::write_file(&path, text.as_bytes())?;
            OpenOptions::new().append(true).open(&path).with_context(|| path.display().to_string())
        };
        let files = [file(JSONL, &json)?, file(CSV, &csv)?];
        Ok(Rows { rows, files: Some(files) })
    }

    /// The rows of a directory.
    pub(crate) fn read(directory: &Path) -> Result<Rows> {
        let path = directory.join(JSONL);
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!("{}: cannot be read; name a directory that `congruent evaluate -o` wrote", path.display())
        })?;
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        let mut rows = Vec::with_capacity(lines.len());
        for (number, line) in (1..).zip(&lines) {
            match serde_json::from_str(line) {
                Ok(row) => rows.push(row),
                // Cut off when the program was stopped.
                Err(_) if number == lines.len() => {}
                Err(error) => {
                    return Err(error).with_context(|| {
                        format!("{}: line {number} is no row; remove it or choose another directory", path.display())
                    });
                }
            }
        }
        Ok(Rows { rows, files: None })
    }

    pub(crate) fn all(&self) -> &[PairRow] {
        &self.rows
    }

    pub(crate) fn find(&self, configuration: &str, pair: &str) -> Option<&PairRow> {
        self.rows.iter().find(|row| row.configuration == configuration && row.pair == pair)
    }

    /// Adds a row, on disk first.
    pub(crate) fn add(&mut self, row: PairRow) -> Result<()> {
        if let Some([jsonl, csv]) = &mut self.files {
            let written = writeln!(jsonl, "{}", json(&row)).and_then(|()| writeln!(csv, "{}", row.csv()));
            written.context("a row cannot be written; check that the disk has room")?;
        }
        self.rows.push(row);
        Ok(())
    }
}

fn json(row: &PairRow) -> String {
    serde_json::to_string(row).expect("numbers, strings and lists can be written as JSON")
}
