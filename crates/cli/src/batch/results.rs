//! The folder that a run writes: rows as pairs end, and what is needed to continue after a kill.

use super::input::{Input, ScanFile};
use super::pairs::Job;
use super::row::{Row, Status};
use super::survey::{Survey, Surveyed};
use super::work::Share;
use super::{columns, hash_of};
use crate::fingerprint::fnv;
use crate::journal::{Journal, read_rows, write_rows};
use anyhow::{Context, Result, bail};
use congruent_io::write_file;
use congruent_pipeline::{PipelineConfig, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// One row per line, written as pairs end; sorted by id at the end of the run.
pub(super) const ROWS: &str = "results.jsonl";
/// The same as a table, written at the end of the run.
const TABLE: &str = "results.csv";
/// The same for programs that read Parquet.
#[cfg(feature = "parquet")]
const PARQUET: &str = "results.parquet";
/// What the rows depend on.
const RUN: &str = "run.json";
/// All settings. Not `congruent.toml`, because results may be written beside the scans.
pub(super) const CONFIGURATION: &str = "configuration.toml";

/// What the rows of a folder depend on: `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Run {
    version: String,
    /// Hash of the settings.
    configuration: String,
    /// Lengths of the collection, data units.
    lengths: Vec<f64>,
    /// Number of pairs in the whole run, all shards together.
    pub(super) pairs: usize,
    /// Hash of what the input says about all pairs: ids, scans, true and initial poses.
    pair_list: String,
    /// Hash of the points of each usable scan, by the scan's name.
    scans: BTreeMap<String, String>,
    /// Number of this shard, and the number of shards.
    shard: [usize; 2],
}

impl Run {
    pub(super) fn new(config: &PipelineConfig, input: &Input, survey: &Survey, jobs: &[Job], shard: Share) -> Run {
        let content = |(file, scan): (&ScanFile, &Result<Surveyed, String>)| {
            Some((file.name.clone(), format!("{:016x}", scan.as_ref().ok()?.content)))
        };
        let pairs: String = jobs.iter().map(|job| job.fingerprint(input.names(job)) + "\n").collect();
        Run {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            configuration: hash_of(config),
            lengths: survey.collection.as_ref().map_or_else(Vec::new, congruent_pipeline::Collection::lengths),
            pairs: jobs.len(),
            pair_list: format!("{:016x}", fnv(pairs.as_bytes())),
            scans: input.scans.iter().zip(&survey.scans).filter_map(content).collect(),
            shard: [shard.part, shard.of],
        }
    }

    pub(super) fn read(folder: &Path) -> Result<Run> {
        let path = folder.join(RUN);
        let text = std::fs::read_to_string(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("{}: was not written by a batch of this version", path.display()))
    }

    pub(super) fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("numbers and strings can be written as JSON");
        Ok(write_file(&folder.join(RUN), format!("{text}\n").as_bytes())?)
    }

    /// Returns the same run without shards.
    pub(super) fn whole(&self) -> Run {
        Run { shard: [1, 1], ..self.clone() }
    }

    /// Says why the rows of another run would differ, and what to do about it; `None` if they would not.
    pub(super) fn difference(&self, other: &Run) -> Option<String> {
        if self.configuration != other.configuration {
            Some(format!(
                "its configuration is {}, not {}; use its {CONFIGURATION} with -c, or choose another folder",
                other.configuration, self.configuration
            ))
        } else if self.version != other.version {
            Some(format!("it was written by version {}, not {}; choose another folder", other.version, self.version))
        } else if self.pair_list != other.pair_list || self.pairs != other.pairs {
            Some(
                "it has other pairs, or other poses given for them; use the same input and choice of pairs, or choose \
                 another folder"
                    .to_owned(),
            )
        } else if let Some((name, _)) =
            self.scans.iter().find(|(name, now)| other.scans.get(*name).is_some_and(|then| then != *now))
        {
            Some(format!(
                "the scan {name} has changed since, or was read with another --thin; use the same --thin, or choose \
                 another folder"
            ))
        } else if self.lengths != other.lengths {
            Some("it has other scans, and so other common lengths; choose another folder".to_owned())
        } else {
            None
        }
    }
}

/// The rows that exist already, and a file for further ones.
pub(super) struct Results {
    earlier: HashSet<String>,
    log: Mutex<Journal>,
}

impl Results {
    /// Starts a folder, or continues one: rows with a verdict are kept.
    pub(super) fn open(folder: &Path, run: Run, config: &PipelineConfig, resume: bool) -> Result<Results> {
        std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be created", folder.display()))?;
        let rows = folder.join(ROWS);
        let earlier: Vec<Row> = if rows.exists() {
            if !resume {
                bail!("{}: already exists; continue with --resume, or choose another folder", rows.display());
            }
            let before = Run::read(folder)?;
            if let Some(difference) = run.difference(&before) {
                bail!("{}: cannot be resumed: {difference}", folder.display());
            }
            if run.shard != before.shard {
                let [part, of] = before.shard;
                bail!(
                    "{}: cannot be resumed: it contains shard {part}/{of}; use --shard {part}/{of}",
                    folder.display()
                );
            }
            let mut rows: Vec<Row> = read_rows(&rows)?;
            rows.retain(|row| row.status == Status::Done);
            rows
        } else {
            run.write(folder)?;
            let text = toml::to_string(config).context("the configuration cannot be written as TOML")?;
            write_file(&folder.join(CONFIGURATION), text.as_bytes())?;
            Vec::new()
        };
        let log = Mutex::new(Journal::begin(&rows, &earlier, "continue with --resume")?);
        Ok(Results { earlier: earlier.into_iter().map(|row| row.id).collect(), log })
    }

    pub(super) fn has(&self, id: &str) -> bool {
        self.earlier.contains(id)
    }

    /// Writes one row at once, so that it is kept whatever happens next.
    pub(super) fn append(&self, row: &Row) -> Result<()> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner).append(row)
    }

    /// Sorts the rows and writes the tables.
    pub(super) fn finish(self, folder: &Path) -> Result<Summary> {
        drop(self.log);
        put(folder, read_rows(&folder.join(ROWS))?)
    }
}

/// Reads all rows of a folder.
pub(super) fn all_rows(folder: &Path) -> Result<Vec<Row>> {
    read_rows(&folder.join(ROWS))
}

/// Sorts the rows, and writes them and the tables.
pub(super) fn put(folder: &Path, mut rows: Vec<Row>) -> Result<Summary> {
    rows.sort_by(|a, b| a.id.cmp(&b.id));
    write_file(&folder.join(TABLE), columns::csv(&rows).as_bytes())?;
    #[cfg(feature = "parquet")]
    write_file(&folder.join(PARQUET), &super::parquet::encode(&rows)?)?;
    write_rows(&folder.join(ROWS), &rows)?;
    Ok(Summary::of(&rows))
}

/// The outcomes of a folder's rows, counted.
pub(super) struct Summary {
    rows: usize,
    verdicts: BTreeMap<Verdict, usize>,
    /// Number of rows without a verdict.
    pub(super) errors: usize,
}

impl Summary {
    fn of(rows: &[Row]) -> Summary {
        let mut verdicts = BTreeMap::new();
        for verdict in rows.iter().filter_map(|row| row.verdict) {
            *verdicts.entry(verdict).or_default() += 1;
        }
        Summary { rows: rows.len(), verdicts, errors: rows.iter().filter(|row| row.status != Status::Done).count() }
    }

    pub(super) fn text(&self, folder: &Path) -> String {
        let counted = self.verdicts.iter().map(|(verdict, n)| format!("{n} {verdict}"));
        let errors = (self.errors > 0).then(|| format!("{} without a verdict (see status)", self.errors));
        let parts: Vec<String> = counted.chain(errors).collect();
        format!("{} pairs: {}; wrote {}", self.rows, parts.join(", "), folder.join(TABLE).display())
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::{broken, done};
    use super::*;

    fn run() -> Run {
        Run {
            version: "1".to_owned(),
            configuration: "aa".to_owned(),
            lengths: vec![0.1, 0.2],
            scans: BTreeMap::from([("a.ply".to_owned(), "1".to_owned())]),
            pairs: 3,
            pair_list: "bb".to_owned(),
            shard: [1, 1],
        }
    }

    #[test]
    fn a_cut_line_is_dropped_and_the_next_row_begins_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let (folder, config) = (folder.path(), PipelineConfig::default());
        let results = Results::open(folder, run(), &config, false).unwrap();
        results.append(&done("b")).unwrap();
        results.append(&broken("bad")).unwrap();
        results.append(&done("c")).unwrap();
        drop(results);
        let rows = folder.join(ROWS);
        let text = std::fs::read(&rows).unwrap();
        std::fs::write(&rows, &text[..text.len() - 9]).unwrap();
        let results = Results::open(folder, run(), &config, true).unwrap();
        assert!(results.has("b") && !results.has("bad") && !results.has("c"));
        results.append(&broken("a")).unwrap();
        let summary = results.finish(folder).unwrap();
        assert_eq!((summary.rows, summary.errors), (2, 1));
        let ids: Vec<String> = read_rows(&rows).unwrap().into_iter().map(|row: Row| row.id).collect();
        assert_eq!(ids, ["a", "b"]);
        assert_eq!(std::fs::read_to_string(folder.join(TABLE)).unwrap().lines().count(), 3);
    }

    #[test]
    fn another_run_is_not_resumed_and_results_are_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let config = PipelineConfig::default();
        let open = |run, resume| Results::open(folder.path(), run, &config, resume).map(drop);
        open(run(), true).unwrap();
        for (other, resume, expected) in [
            (run(), false, "--resume"),
            (Run { configuration: "ab".to_owned(), ..run() }, true, "with -c"),
            (Run { lengths: vec![0.3], ..run() }, true, "other common lengths"),
            (Run { scans: BTreeMap::from([("a.ply".to_owned(), "2".to_owned())]), ..run() }, true, "a.ply has changed"),
            (Run { pair_list: "bc".to_owned(), ..run() }, true, "other pairs"),
            (Run { shard: [2, 3], ..run() }, true, "use --shard 1/1"),
        ] {
            let message = open(other, resume).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        open(run(), true).unwrap();
    }
}
