//! The folder that a run writes: rows as pairs end, and what is needed to continue after a kill.

use super::columns;
use super::row::{Row, Status};
use super::run::{Run, WHOLE};
use crate::journal::{Journal, read_rows, write_rows};
use anyhow::{Context, Result, bail};
use congruent_io::write_file;
use congruent_pipeline::{PipelineConfig, Verdict};
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
/// All settings. Not `congruent.toml`, because results may be written beside the scans.
pub(super) const CONFIGURATION: &str = "configuration.toml";

/// The rows that exist already, and a file for further ones.
pub(super) struct Results {
    earlier: HashSet<String>,
    /// Number of earlier rows with a verdict whose pairs are no longer wanted.
    pub(super) dropped: usize,
    log: Mutex<Journal>,
}

impl Results {
    /// Starts a folder, or continues one: rows with a verdict are kept if their pairs are still wanted. `wanted` are the
    /// fingerprints of the pairs.
    pub(super) fn open(
        folder: &Path,
        run: Run,
        wanted: &HashSet<String>,
        config: &PipelineConfig,
        resume: bool,
    ) -> Result<Results> {
        std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be created", folder.display()))?;
        let path = folder.join(ROWS);
        if path.exists() && !resume {
            bail!("{}: already exists; continue with --resume, or choose another folder", path.display());
        }
        let (run, mut rows) = if path.exists() { continued(folder, run)? } else { (run, Vec::new()) };
        let n_earlier = rows.len();
        rows.retain(|row| wanted.contains(&row.pair));
        run.write(folder)?;
        let text = toml::to_string(config).context("the configuration cannot be written as TOML")?;
        write_file(&folder.join(CONFIGURATION), text.as_bytes())?;
        let log = Mutex::new(Journal::begin(&path, &rows, "continue with --resume")?);
        let dropped = n_earlier - rows.len();
        Ok(Results { earlier: rows.into_iter().map(|row| row.id).collect(), dropped, log })
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

/// Returns the rows with a verdict that a folder has, and the run with what it knows about the scans; refuses rows that
/// this run would not write.
fn continued(folder: &Path, run: Run) -> Result<(Run, Vec<Row>)> {
    let before = Run::read(folder)?;
    if let Some(difference) = run.difference(&before) {
        bail!("{}: cannot be resumed: {difference}", folder.display());
    }
    if run.shard != before.shard {
        let [part, of] = before.shard;
        bail!("{}: cannot be resumed: it contains shard {part}/{of}; use --shard {part}/{of}", folder.display());
    }
    // Which pairs are those of a shard depends on all pairs, and the other shards have theirs already.
    if let Some(difference) = run.other_pairs(&before).filter(|_| run.shard != WHOLE) {
        bail!("{}: cannot be resumed: {difference}", folder.display());
    }
    let mut rows: Vec<Row> = read_rows(&folder.join(ROWS))?;
    rows.retain(|row| row.status == Status::Done);
    Ok((run.completed(&before), rows))
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

    fn scans(all: &[(&str, Option<&str>)]) -> BTreeMap<String, Option<String>> {
        all.iter().map(|(name, content)| ((*name).to_owned(), content.map(str::to_owned))).collect()
    }

    /// The fingerprints of pairs with these ids.
    fn wanted(ids: &[&str]) -> HashSet<String> {
        ids.iter().map(|id| done(id).pair).collect()
    }

    fn run() -> Run {
        Run {
            version: "1".to_owned(),
            configuration: "aa".to_owned(),
            lengths: vec![0.1, 0.2],
            scans: scans(&[("a.ply", Some("1"))]),
            pairs: 3,
            pair_list: "bb".to_owned(),
            shard: [1, 1],
        }
    }

    #[test]
    fn a_cut_line_is_dropped_and_the_next_row_begins_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let (folder, config) = (folder.path(), PipelineConfig::default());
        let wanted = wanted(&["a", "b", "bad", "c"]);
        let results = Results::open(folder, run(), &wanted, &config, false).unwrap();
        results.append(&done("b")).unwrap();
        results.append(&broken("bad")).unwrap();
        results.append(&done("c")).unwrap();
        drop(results);
        let rows = folder.join(ROWS);
        let text = std::fs::read(&rows).unwrap();
        std::fs::write(&rows, &text[..text.len() - 9]).unwrap();
        let results = Results::open(folder, run(), &wanted, &config, true).unwrap();
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
        let open = |run, resume| Results::open(folder.path(), run, &HashSet::new(), &config, resume).map(drop);
        open(run(), true).unwrap();
        for (other, resume, expected) in [
            (run(), false, "--resume"),
            (Run { configuration: "ab".to_owned(), ..run() }, true, "with -c"),
            (Run { lengths: vec![0.3], ..run() }, true, "other common lengths"),
            (Run { scans: scans(&[("a.ply", Some("2"))]), ..run() }, true, "a.ply has changed"),
            (
                Run { scans: scans(&[("a.ply", Some("1")), ("b.ply", None)]), ..run() },
                true,
                "the scan b.ply is in only",
            ),
            (Run { scans: scans(&[]), ..run() }, true, "the scan a.ply is in only"),
            (Run { shard: [2, 3], ..run() }, true, "use --shard 1/1"),
        ] {
            let message = open(other, resume).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        open(run(), true).unwrap();
    }

    /// Pairs may change with a scan that was repaired: `--pairs auto` then finds scans that are like it.
    #[test]
    fn rows_whose_pairs_are_still_wanted_are_kept_but_shards_keep_their_pairs() {
        let folder = tempfile::tempdir().unwrap();
        let (folder, config) = (folder.path(), PipelineConfig::default());
        let open = |run, ids: &[&str]| Results::open(folder, run, &wanted(ids), &config, true);
        let before = Run { scans: scans(&[("a.ply", Some("1")), ("b.ply", None), ("c.ply", None)]), ..run() };
        let results = open(before, &["a", "b"]).unwrap();
        results.append(&done("a")).unwrap();
        results.append(&done("b")).unwrap();
        drop(results);
        let now = Run {
            scans: scans(&[("a.ply", None), ("b.ply", Some("2"))]),
            pairs: 2,
            pair_list: "bc".to_owned(),
            ..run()
        };
        let results = open(now.clone(), &["b", "c"]).unwrap();
        assert!(results.has("b") && !results.has("a") && results.dropped == 1);
        drop(results);
        let known = Run { scans: scans(&[("a.ply", Some("1")), ("b.ply", Some("2"))]), ..now.clone() };
        assert_eq!(Run::read(folder).unwrap(), known);
        Run { shard: [2, 3], ..known }.write(folder).unwrap();
        let shard = |pair_list: &str| Run { shard: [2, 3], pair_list: pair_list.to_owned(), ..now.clone() };
        assert!(open(shard("bb"), &["b"]).err().unwrap().to_string().contains("other pairs"));
        assert!(open(shard("bc"), &["b"]).unwrap().has("b"));
    }
}
