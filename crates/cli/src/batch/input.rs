//! What is to be registered: a folder of scans, a table of pairs, or a data set.

use super::pairs::{self, Job};
use super::table::Table;
use crate::args::PairChoice;
use crate::commands::{Reading, listed_pairs};
use crate::output;
use anyhow::{Context, Result, bail};
use congruent_io::PairEntry;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Extensions of the files in a folder that are taken for scans. The content decides whether they can be read.
const SCANS: [&str; 11] = ["ply", "pcd", "obj", "stl", "off", "xyz", "pts", "asc", "las", "laz", "e57"];
/// The table of pairs in a folder.
const TABLE: &str = "pairs.csv";
/// The description of a data set in a folder.
const DATASET: &str = "dataset.toml";
/// The subfolder with the scans, if a folder has other files beside it.
const SCAN_FOLDER: &str = "scans";

/// Scans, and which pairs of them are wanted (at least one).
#[derive(Debug)]
pub(crate) struct Input {
    /// The folder in which a `congruent.toml` is looked for.
    pub(super) folder: PathBuf,
    /// In the order of their names (a folder) or of their first use (a table).
    pub(crate) scans: Vec<ScanFile>,
    /// How they are read.
    pub(crate) reading: Reading,
    pub(super) wanted: Wanted,
    /// Remarks for the user on anything unusual.
    pub(super) remarks: Vec<String>,
    /// Number of pairs, scenes or parts of a ground truth that cannot be used; each has been reported.
    pub(super) broken: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct ScanFile {
    /// The name in the table, or that of the file in the folder.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
}

/// Which pairs are wanted.
#[derive(Debug)]
pub(super) enum Wanted {
    Listed(Vec<Job>),
    All,
    Sequential,
    Auto,
}

impl From<PairChoice> for Wanted {
    fn from(choice: PairChoice) -> Wanted {
        match choice {
            PairChoice::All => Wanted::All,
            PairChoice::Sequential => Wanted::Sequential,
            PairChoice::Auto => Wanted::Auto,
        }
    }
}

impl Input {
    /// Finds the input that a path leads to. A choice of pairs takes precedence over the pairs that a folder lists.
    /// `data` is the folder with the files of a data set, if they are not beside its description.
    pub(crate) fn find(path: &Path, choice: Option<PairChoice>, data: Option<&Path>) -> Result<Input> {
        let is_folder = path.is_dir();
        let described = path.join(DATASET);
        let input = if is_folder && described.is_file() {
            of_dataset(&described, data, choice)?
        } else if !is_folder && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            of_dataset(path, data, choice)?
        } else if data.is_some() {
            bail!("{}: --data is for a {DATASET}, but there is none; omit --data", path.display());
        } else if is_folder {
            let table = path.join(TABLE);
            if choice.is_none() && table.is_file() { of_own_table(&table)? } else { of_folder(path, choice)? }
        } else if choice.is_some() {
            bail!("{}: a table lists its own pairs; omit --pairs and --sequential", path.display());
        } else {
            of_given_table(path)?
        };
        match &input.wanted {
            Wanted::Listed(jobs) if jobs.is_empty() => bail!("{}: lists no pairs; add at least one", path.display()),
            Wanted::All | Wanted::Sequential | Wanted::Auto if input.scans.len() < 2 => bail!(
                "{}: a pair needs two scans, but {} there with extension .{}; a table can list other files",
                path.display(),
                if input.scans.is_empty() { "none is" } else { "only one is" },
                SCANS.join(" .")
            ),
            _ => Ok(input),
        }
    }

    /// Returns the input with another choice of pairs.
    pub(crate) fn choosing(self, choice: PairChoice) -> Input {
        Input { wanted: choice.into(), ..self }
    }

    /// Returns the names of a pair's source and target.
    pub(super) fn names(&self, job: &Job) -> [&str; 2] {
        [job.source, job.target].map(|at| self.scans[at].name.as_str())
    }
}

fn of_folder(folder: &Path, choice: Option<PairChoice>) -> Result<Input> {
    let inner = folder.join(SCAN_FOLDER);
    let place = if inner.is_dir() { inner } else { folder.to_owned() };
    let (mut scans, mut remarks) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(&place).with_context(|| format!("{}: cannot be listed", place.display()))? {
        let entry = entry.with_context(|| format!("{}: cannot be listed", place.display()))?;
        // Hidden files: what a system keeps beside a file, or what is not complete yet.
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let path = entry.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if !SCANS.contains(&extension.as_str()) {
            continue;
        }
        if path.is_dir() {
            remarks.push(format!("{}: is a directory, not a scan; ignored", path.display()));
        } else {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            scans.push(ScanFile { name, path });
        }
    }
    in_order(&mut scans);
    remarks.sort();
    let wanted = choice.map_or(Wanted::All, Wanted::from);
    Ok(Input { folder: folder.to_owned(), scans, reading: Reading::default(), wanted, remarks, broken: 0 })
}

fn in_order(scans: &mut [ScanFile]) {
    scans.sort_by_cached_key(|scan| (pairs::natural(&scan.name), scan.name.clone()));
}

/// Takes a table that the user named: any fault stops.
fn of_given_table(path: &Path) -> Result<Input> {
    let table = Table::read(path)?;
    match table.faults.first() {
        Some(fault) => bail!("{fault}"),
        None => Ok(of_table(path, table)),
    }
}

/// Takes the table of a folder, which may be a data set: what cannot be used is reported and skipped, as in one.
fn of_own_table(path: &Path) -> Result<Input> {
    let table = Table::read(path)?;
    match table.faults.first() {
        Some(fault) if table.pairs.is_empty() => bail!("{fault}"),
        _ => table.faults.iter().for_each(|fault| output::complain(&format!("{fault}; the pair is skipped"))),
    }
    Ok(of_table(path, table))
}

fn of_table(path: &Path, Table { pairs, faults, remarks }: Table) -> Input {
    let folder = folder_of(path);
    let mut scans = Scans::default();
    let job = |pair: PairEntry| {
        let [source, target] = [&pair.source, &pair.target].map(|name| scans.place(name, || located(&folder, name)));
        let id = pair.id.unwrap_or_else(|| pairs::id_of(&pair.source, &pair.target));
        Job { id, source, target, truth: pair.truth.map(|truth| truth.pose), guess: pair.init.map(|init| init.pose) }
    };
    let wanted = Wanted::Listed(pairs.into_iter().map(job).collect());
    Input { folder, scans: scans.files, reading: Reading::default(), wanted, remarks, broken: faults.len() }
}

fn of_dataset(path: &Path, data: Option<&Path>, choice: Option<PairChoice>) -> Result<Input> {
    // With another choice of pairs only the scans count, those that overlap with no other one included.
    let dataset = listed_pairs(path, data, choice.map(|_| 0.0))?;
    if dataset.pairs.is_empty() && dataset.min_overlap > 0.0 {
        let (shown, least) = (path.display(), dataset.min_overlap);
        bail!("{shown}: no pair has an overlap of {least}; lower min-overlap in it, or choose pairs with --pairs");
    }
    let mut scans = Scans::default();
    let jobs = dataset.pairs.iter().map(|pair| Job {
        id: pair.id.clone().unwrap_or_else(|| pairs::id_of(&pair.source, &pair.target)),
        source: scans.place(&pair.source, || pair.source_file.clone()),
        target: scans.place(&pair.target, || pair.target_file.clone()),
        truth: Some(pair.target_from_source),
        guess: None,
    });
    let mut wanted = Wanted::Listed(jobs.collect());
    let mut scans = scans.files;
    if let Some(choice) = choice {
        in_order(&mut scans);
        wanted = choice.into();
    }
    let (remarks, broken) = (Vec::new(), dataset.broken.len());
    Ok(Input { folder: folder_of(path), scans, reading: Reading::default(), wanted, remarks, broken })
}

/// Collects each scan once.
#[derive(Default)]
struct Scans {
    files: Vec<ScanFile>,
    known: HashMap<String, usize>,
}

impl Scans {
    fn place(&mut self, name: &str, path: impl FnOnce() -> PathBuf) -> usize {
        if let Some(at) = self.known.get(name) {
            return *at;
        }
        self.files.push(ScanFile { name: name.to_owned(), path: path() });
        self.known.insert(name.to_owned(), self.files.len() - 1);
        self.files.len() - 1
    }
}

fn folder_of(file: &Path) -> PathBuf {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}

/// Returns the path beside the table, or in the folder of scans beside it.
fn located(folder: &Path, name: &str) -> PathBuf {
    let beside = folder.join(name);
    let inner = folder.join(SCAN_FOLDER).join(name);
    if !beside.exists() && inner.exists() { inner } else { beside }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(path: &Path, choice: Option<PairChoice>, expected: &str) {
        let message = Input::find(path, choice, None).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()) && message.contains(expected), "{message}");
    }

    #[test]
    fn too_few_scans_and_no_pairs_are_said_with_a_way_out() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        check(folder.path(), None, "none is there with extension .ply .pcd");
        std::fs::create_dir(at("x.ply")).unwrap();
        std::fs::write(at("a.PLY"), "").unwrap();
        std::fs::write(at("notes.txt"), "").unwrap();
        check(folder.path(), Some(PairChoice::Auto), "only one is there");
        std::fs::write(at("b.laz"), "").unwrap();
        let input = Input::find(folder.path(), None, None).unwrap();
        let names: Vec<&str> = input.scans.iter().map(|scan| scan.name.as_str()).collect();
        assert_eq!(names, ["a.PLY", "b.laz"]);
        assert!(input.remarks.len() == 1 && input.remarks[0].contains("x.ply: is a directory"), "{:?}", input.remarks);
        std::fs::write(at("pairs.csv"), "source,target\n").unwrap();
        check(folder.path(), None, "lists no pairs");
        check(&at("pairs.csv"), Some(PairChoice::All), "omit --pairs");
        check(&at("absent"), None, "cannot be read as a folder or a table of pairs");
    }

    #[test]
    fn a_data_set_gives_pairs_with_truth_and_its_folder_may_be_elsewhere() {
        let (described, data) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let file = described.path().join("dataset.toml");
        let toml = "name = 'set'\nscans = 'ply'\n[truth]\nformat = 'pose-list'\npath = 'truth.txt'\ninverted = true\n";
        std::fs::write(&file, toml).unwrap();
        let truth = "s10.ply s9.ply 1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1\n";
        std::fs::write(data.path().join("truth.txt"), truth).unwrap();
        for path in [described.path(), &file] {
            let input = Input::find(path, None, Some(data.path())).unwrap();
            let Wanted::Listed(jobs) = &input.wanted else { panic!("{:?}", input.wanted) };
            assert_eq!(jobs[0].id, "s10.ply--s9.ply");
            assert_eq!(jobs[0].truth.unwrap().translation.vector.x, -3.0);
            assert_eq!(input.scans[jobs[0].target].path, data.path().join("ply/s9.ply"));
            assert_eq!(input.folder, described.path());
            let chosen = Input::find(path, Some(PairChoice::Sequential), Some(data.path())).unwrap();
            assert!(matches!(chosen.wanted, Wanted::Sequential) && chosen.scans[0].name == "s9.ply");
        }
        let message = Input::find(data.path(), None, Some(data.path())).unwrap_err().to_string();
        assert!(message.contains("--data is for a dataset.toml"), "{message}");
    }

    #[test]
    fn a_scan_is_known_by_its_name_and_found_upwards_and_in_scans() {
        let folder = tempfile::tempdir().unwrap();
        let tables = folder.path().join("tables");
        std::fs::create_dir_all(tables.join("scans")).unwrap();
        std::fs::write(folder.path().join("a b.ply"), "").unwrap();
        std::fs::write(tables.join("scans/c.ply"), "").unwrap();
        std::fs::write(tables.join("t.csv"), "source,target\n../a b.ply,c.ply\nc.ply,../a b.ply\n").unwrap();
        let input = Input::find(&tables.join("t.csv"), None, None).unwrap();
        assert_eq!(input.scans.len(), 2);
        assert!(input.scans.iter().all(|scan| scan.path.is_file()), "{:?}", input.scans);
    }

    #[test]
    fn a_bad_line_stops_a_given_table_and_is_skipped_in_that_of_a_folder_with_or_without_a_description() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("pairs.csv");
        let matrix = "r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz";
        let good = "1,0,0,5,0,1,0,0,0,0,1,0";
        // The same pair twice is told apart by its ids.
        let text =
            format!("id,source,target,{matrix}\np,b,a,{good}\nq,b,a,{good}\nbad,b,a,{}\n", good.replace('5', "x"));
        std::fs::write(&table, text).unwrap();
        check(&table, None, "line 4: `x` in the column `tx`");
        let found = || {
            let input = Input::find(folder.path(), None, None).unwrap();
            let Wanted::Listed(jobs) = input.wanted else { panic!("{:?}", input.wanted) };
            let ids: Vec<String> = pairs::sorted(jobs).unwrap().into_iter().map(|job| job.id).collect();
            (ids, input.broken)
        };
        assert_eq!(found(), (vec!["p".to_owned(), "q".to_owned()], 1));
        let toml = "name = 'set'\n[truth]\nformat = 'pairs-csv'\npath = 'pairs.csv'\n";
        std::fs::write(folder.path().join("dataset.toml"), toml).unwrap();
        assert_eq!(found(), (vec!["p".to_owned(), "q".to_owned()], 1));
        std::fs::remove_file(folder.path().join("dataset.toml")).unwrap();
        std::fs::write(&table, "source,target\nb,\n").unwrap();
        let message = Input::find(folder.path(), None, None).unwrap_err().to_string();
        assert!(message.contains("pairs.csv: line 2: source, target"), "{message}");
    }
}
