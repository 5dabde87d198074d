//! What is to be registered: a folder of scans, a table of pairs, or a dataset with both.

use super::pairs::{self, Job};
use crate::args::PairChoice;
use anyhow::{Context, Result, anyhow, bail};
use congruent_geometry::{RigidTransform, from_rows};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Files of a folder that are taken for scans. The content decides whether they can be read.
const SCANS: [&str; 12] = ["ply", "pcd", "obj", "stl", "off", "xyz", "pts", "ptx", "asc", "las", "laz", "e57"];
/// The table in a dataset folder.
const TABLE: &str = "pairs.csv";
/// The scans in a dataset folder.
const SCAN_FOLDER: &str = "scans";
/// How far a true pose may be from a rigid motion (Frobenius norm).
const TOLERANCE: f64 = 1e-3;
/// Names of the columns of a true pose in a CSV table: the upper three rows of the matrix.
const TRUTH: [&str; 12] = ["r00", "r01", "r02", "tx", "r10", "r11", "r12", "ty", "r20", "r21", "r22", "tz"];

/// Scans, and which pairs of them are wanted.
#[derive(Debug)]
pub(crate) struct Input {
    /// Where a `congruent.toml` is looked for.
    pub(super) folder: PathBuf,
    /// In the order of their names (a folder) or of their first use (a table).
    pub(crate) scans: Vec<ScanFile>,
    pub(super) wanted: Wanted,
}

#[derive(Clone, Debug)]
pub(crate) struct ScanFile {
    /// As the table has it, or the file's name in the folder.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
}

/// Which pairs.
#[derive(Debug)]
pub(super) enum Wanted {
    Listed(Vec<Job>),
    All,
    Sequential,
    Auto,
}

impl Input {
    /// Looks at what the path leads to. A choice of pairs comes before the table of a dataset folder.
    pub(crate) fn find(path: &Path, choice: Option<PairChoice>) -> Result<Input> {
        if path.is_dir() {
            let table = path.join(TABLE);
            return if choice.is_none() && table.is_file() { of_table(&table) } else { of_folder(path, choice) };
        }
        if choice.is_some() {
            bail!("{}: a table says its pairs itself; leave out --pairs and --sequential", path.display());
        }
        of_table(path)
    }
}

fn of_folder(folder: &Path, choice: Option<PairChoice>) -> Result<Input> {
    let inner = folder.join(SCAN_FOLDER);
    let place = if inner.is_dir() { inner } else { folder.to_owned() };
    let mut scans = Vec::new();
    for entry in std::fs::read_dir(&place).with_context(|| format!("{}: cannot be listed", place.display()))? {
        let path = entry.with_context(|| format!("{}: cannot be listed", place.display()))?.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if SCANS.contains(&extension.as_str()) && path.is_file() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            scans.push(ScanFile { name, path });
        }
    }
    scans.sort_by_cached_key(|scan| (pairs::natural(&scan.name), scan.name.clone()));
    let wanted = match choice {
        None | Some(PairChoice::All) => Wanted::All,
        Some(PairChoice::Sequential) => Wanted::Sequential,
        Some(PairChoice::Auto) => Wanted::Auto,
    };
    Ok(Input { folder: folder.to_owned(), scans, wanted })
}

fn of_table(path: &Path) -> Result<Input> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| anyhow!("{}: cannot be read as a folder or a table of pairs: {error}", path.display()))?;
    let is_jsonl = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("jsonl"));
    let lines = if is_jsonl { jsonl(&text) } else { csv(&text) };
    let lines = lines.map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
    let mut scans: Vec<ScanFile> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    let mut jobs = Vec::new();
    for line in lines {
        let mut place = |name: &str| {
            *known.entry(name.to_owned()).or_insert_with(|| {
                scans.push(ScanFile { name: name.to_owned(), path: located(&folder, name) });
                scans.len() - 1
            })
        };
        let (source, target) = (place(&line.source), place(&line.target));
        let id = line.id.unwrap_or_else(|| pairs::id_of(&line.source, &line.target));
        jobs.push(Job { id, source, target, truth: line.truth });
    }
    Ok(Input { folder, scans, wanted: Wanted::Listed(jobs) })
}

/// Beside the table, or in the folder of scans beside it.
fn located(folder: &Path, name: &str) -> PathBuf {
    let beside = folder.join(name);
    let inner = folder.join(SCAN_FOLDER).join(name);
    if !beside.exists() && inner.exists() { inner } else { beside }
}

struct Line {
    id: Option<String>,
    source: String,
    target: String,
    truth: Option<RigidTransform>,
}

fn csv(text: &str) -> Result<Vec<Line>> {
    let mut lines = (1..).zip(text.trim_start_matches('\u{feff}').lines());
    let mut rows = lines.by_ref().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let (_, header) =
        rows.next().ok_or_else(|| anyhow!("is empty; name the columns source,target in the first line"))?;
    let names: Vec<String> = fields(header).iter().map(|name| name.to_ascii_lowercase()).collect();
    let column = |wanted: &str| names.iter().position(|name| name == wanted);
    let needed = |wanted: &str| {
        column(wanted).ok_or_else(|| anyhow!("there is no column `{wanted}` among `{}`", names.join(",")))
    };
    let (source, target, id) = (needed("source")?, needed("target")?, column("id"));
    let truth: Option<Vec<usize>> = TRUTH.iter().map(|name| column(name)).collect();
    let row = |(number, line): (usize, &str)| {
        let fields = fields(line);
        if fields.len() != names.len() {
            bail!("line {number}: holds {} fields, the header names {}", fields.len(), names.len());
        }
        let truth = truth.iter().map(|columns| {
            let numbers = columns.iter().map(|&at| fields[at].trim().parse::<f64>()).collect::<Result<Vec<f64>, _>>();
            rigid(&numbers.map_err(|error| anyhow!("line {number}: the true pose: {error}"))?, number)
        });
        let truth = truth.collect::<Result<Vec<_>>>()?.pop();
        let (source, target) = (fields[source].clone(), fields[target].clone());
        named(Line { id: id.map(|at| fields[at].clone()), source, target, truth }, number)
    };
    rows.map(row).collect()
}

fn jsonl(text: &str) -> Result<Vec<Line>> {
    #[derive(serde::Deserialize)]
    struct Object {
        id: Option<String>,
        source: String,
        target: String,
        truth: Option<[[f64; 4]; 4]>,
    }
    let rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    rows.map(|(number, line)| {
        let Object { id, source, target, truth } =
            serde_json::from_str(line).map_err(|error| anyhow!("line {number}: {error}"))?;
        let truth = truth.map(|rows| rigid(rows[..3].as_flattened(), number)).transpose()?;
        named(Line { id, source, target, truth }, number)
    })
    .collect()
}

fn named(line: Line, number: usize) -> Result<Line> {
    if line.source.is_empty() || line.target.is_empty() || line.id.as_ref().is_some_and(String::is_empty) {
        bail!("line {number}: source, target and id may not be empty");
    }
    Ok(line)
}

/// From the upper three rows.
fn rigid(numbers: &[f64], line: usize) -> Result<RigidTransform> {
    let row = |i: usize| std::array::from_fn(|j| numbers[4 * i + j]);
    from_rows(&[row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]], TOLERANCE)
        .ok_or_else(|| anyhow!("line {line}: the true pose is no rigid motion; remove scale, shear and mirroring"))
}

/// The fields of a CSV line; one in double quotes may hold commas, and quotes written twice.
pub(super) fn fields(line: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.trim_end_matches('\r').chars().peekable();
    while let Some(c) = characters.next() {
        let last = all.last_mut().expect("there is always a field");
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                last.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            _ => last.push(c),
        }
    }
    all.iter_mut().for_each(|field| *field = field.trim().to_owned());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_may_be_quoted() {
        assert_eq!(fields(r#"a, b ,"c,""d""",,"#), ["a", "b", r#"c,"d""#, "", ""]);
    }

    #[test]
    fn tables_are_read_in_both_forms_and_faults_have_their_line() {
        let one = csv("source,target,id\na.ply,b.ply,first\n").unwrap();
        let other = jsonl("{\"source\":\"a.ply\",\"target\":\"b.ply\",\"id\":\"first\"}\n").unwrap();
        for lines in [one, other] {
            assert_eq!((lines[0].source.as_str(), lines[0].target.as_str()), ("a.ply", "b.ply"));
            assert!(lines[0].id.as_deref() == Some("first") && lines[0].truth.is_none());
        }
        let identity = "source,target,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz\na,b,1,0,0,5,0,1,0,0,0,0,1,0\n";
        assert_eq!(csv(identity).unwrap()[0].truth.unwrap().translation.vector.x, 5.0);
        for (text, expected) in [
            ("source,traget\n", "no column `target`"),
            ("source,target\na\n", "line 2: holds 1 fields"),
            ("source,target\na,\n", "line 2: source, target"),
            ("", "is empty"),
            (&identity.replace("1,0,0,5", "2,0,0,5"), "line 2: the true pose"),
        ] {
            let message = csv(text).err().unwrap().to_string();
            assert!(message.contains(expected), "{message}");
        }
        assert!(jsonl("{}").err().unwrap().to_string().contains("line 1: missing field"));
    }
}
