//! Data sets: which scans belong together, and the true motions between them.
//!
//! A folder with `pairs.csv` and `scans/` is a data set as it is. Any other layout is described by a `dataset.toml`.

mod about;
mod gt_log;
mod lines;
mod pairs_csv;
mod pose_list;
mod stanford;
mod xf_folder;

pub use about::{About, TruthAbout, TruthFormat};
pub use lines::DatasetFault;
pub use pairs_csv::{PairLine, pairs_csv};

use crate::IoError;
use crate::read::bytes_of;
use congruent_geometry::{RigidTransform, from_rows};
use std::path::{Path, PathBuf};

/// A printed matrix farther from a rigid motion than this (Frobenius norm) is worth a warning …
const WARN_ABOVE: f64 = 1e-3;
/// … and one farther than this is none.
const REFUSE_ABOVE: f64 = 0.1;

/// Pairs of scans with their truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// What it is called.
    pub name: String,
    /// In the order of its ground truth.
    pub pairs: Vec<TruePair>,
    /// What is odd about the ground truth, for the user to read.
    pub warnings: Vec<String>,
}

/// Two scan files and the motion between them.
#[derive(Clone, Debug, PartialEq)]
pub struct TruePair {
    /// As the data set names it.
    pub source: String,
    /// As the data set names it.
    pub target: String,
    /// Where the source is.
    pub source_file: PathBuf,
    /// Where the target is.
    pub target_file: PathBuf,
    /// Share of points that both have, where the data set says so.
    pub overlap: Option<f64>,
    /// The truth, projected onto rigid motions.
    pub target_from_source: RigidTransform,
}

/// Reads a folder, or a `dataset.toml`. `data` is where the files are, if not beside the description.
///
/// # Errors
/// The description or the ground truth cannot be read or breaks its format. Scans are not opened.
pub fn read_dataset(path: &Path, data: Option<&Path>) -> Result<Dataset, IoError> {
    let description = if path.is_dir() { path.join("dataset.toml") } else { path.to_owned() };
    let about = if path.is_dir() && !description.exists() {
        About::plain(path)
    } else {
        About::parse(&text_of(&description)?).map_err(|fault| IoError::Dataset { path: description.clone(), fault })?
    };
    let root = data.unwrap_or_else(|| if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) });
    let place = root.join(&about.truth.path);
    let faulty = |fault| IoError::Dataset { path: place.clone(), fault };
    let truths = match about.truth.format {
        TruthFormat::PairsCsv => pairs_csv::parse(&text_of(&place)?).map_err(faulty)?,
        TruthFormat::PoseList => pose_list::parse(&text_of(&place)?).map_err(faulty)?,
        TruthFormat::GtLog => gt_log::parse(&text_of(&place)?, &about.truth.names).map_err(faulty)?,
        TruthFormat::StanfordConf => stanford::parse(&text_of(&place)?).map_err(faulty)?,
        TruthFormat::XfFolder => xf_folder::read(&place, &about.truth.names)?,
    };
    Ok(dataset(about, root, truths))
}

fn dataset(about: About, root: &Path, truths: Vec<Truth>) -> Dataset {
    let folder = root.join(&about.scans);
    let mut warnings = Vec::new();
    let mut pairs = Vec::with_capacity(truths.len());
    for Truth { source, target, overlap, motion: Motion { pose, skew } } in truths {
        if skew > WARN_ABOVE {
            warnings.push(format!(
                "{source} to {target}: the true motion is {skew:.1e} away from a rigid one; the nearest rigid one is used"
            ));
        }
        let target_from_source = if about.truth.inverted { pose.inverse() } else { pose };
        let (source_file, target_file) = (folder.join(&source), folder.join(&target));
        pairs.push(TruePair { source, target, source_file, target_file, overlap, target_from_source });
    }
    Dataset { name: about.name, pairs, warnings }
}

fn text_of(path: &Path) -> Result<String, IoError> {
    let bytes = bytes_of(path)?;
    String::from_utf8(bytes).map_err(|_| IoError::Dataset { path: path.to_owned(), fault: DatasetFault::NotText })
}

/// One pair as the ground truth names it.
#[derive(Clone, Debug, PartialEq)]
struct Truth {
    source: String,
    target: String,
    overlap: Option<f64>,
    motion: Motion,
}

/// The nearest rigid motion to a matrix, and how near it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    pose: RigidTransform,
    skew: f64,
}

impl Motion {
    /// From the first twelve or sixteen numbers, row by row.
    fn new(numbers: &[f64], line: usize) -> Result<Motion, DatasetFault> {
        let mut rows = [[0.0, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, 1.0]];
        for (i, value) in numbers.iter().take(12).enumerate() {
            rows[i / 4][i % 4] = *value;
        }
        let pose = from_rows(&rows, REFUSE_ABOVE).ok_or(DatasetFault::NotRigid { line })?;
        let rotation = pose.rotation.to_rotation_matrix();
        let difference = |row: usize, column: usize| (rotation[(row, column)] - rows[row][column]).powi(2);
        let skew_sq: f64 = (0..3).flat_map(|row| (0..3).map(move |column| difference(row, column))).sum();
        Ok(Motion { pose, skew: skew_sq.sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use tempfile::TempDir;

    fn folder(files: &[(&str, &str)]) -> TempDir {
        let folder = TempDir::new().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        folder
    }

    const HEADER: &str = "source,target,overlap,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz";

    #[test]
    fn a_plain_folder_is_a_data_set() {
        let text = format!("{HEADER}\nb.ply,a.ply,0.25,0,-1,0,4,1,0,0,5,0,0,1,6\n");
        let folder = folder(&[("pairs.csv", &text)]);
        let dataset = read_dataset(folder.path(), None).unwrap();
        let pair = &dataset.pairs[0];
        assert_eq!((pair.source.as_str(), pair.target.as_str(), pair.overlap), ("b.ply", "a.ply", Some(0.25)));
        assert_eq!(pair.source_file, folder.path().join("scans/b.ply"));
        let image = pair.target_from_source * nalgebra_point(1.0, 0.0, 0.0);
        assert!((image.coords - nalgebra_point(4.0, 6.0, 6.0).coords).norm() < 1e-12);
        assert!(dataset.warnings.is_empty() && dataset.name == folder.path().file_name().unwrap().to_str().unwrap());
    }

    fn nalgebra_point(x: f64, y: f64, z: f64) -> nalgebra::Point3<f64> {
        nalgebra::Point3::new(x, y, z)
    }

    #[test]
    fn a_description_says_where_things_are_and_which_way_the_truth_maps() {
        let toml = "name = 'set'\nunit = 'mm'\nlicence = 'free'\nsource = 'nowhere'\nscans = 'ply'\n\
                    [truth]\nformat = 'pose-list'\npath = 'truth.txt'\ninverted = true\n";
        let described = folder(&[("dataset.toml", toml)]);
        let data = folder(&[("truth.txt", "a.ply b.ply 1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1\n")]);
        let dataset = read_dataset(described.path(), Some(data.path())).unwrap();
        assert_eq!(dataset.name, "set");
        assert_eq!(dataset.pairs[0].target_file, data.path().join("ply/b.ply"));
        assert_eq!(dataset.pairs[0].target_from_source.translation.vector.x, -3.0);
        let missing = read_dataset(described.path(), None).unwrap_err().to_string();
        assert!(missing.contains("truth.txt") && missing.contains("cannot be read"), "{missing}");
    }

    #[test]
    fn skewed_truth_is_projected_with_a_warning_and_wild_truth_is_refused() {
        let with = |r00: &str| format!("{HEADER}\nb.ply,a.ply,0.5,{r00},0,0,0,0,1,0,0,0,0,1,0\n");
        let read = |text: &str| read_dataset(folder(&[("pairs.csv", text)]).path(), None);
        assert!(read(&with("1.0005")).unwrap().warnings.is_empty());
        let skewed = read(&with("1.002")).unwrap();
        assert!(skewed.warnings[0].contains("b.ply to a.ply") && skewed.warnings[0].contains("2.0e-3"));
        assert_eq!(skewed.pairs[0].target_from_source, RigidTransform::identity());
        let refused = read(&with("3")).unwrap_err().to_string();
        assert!(refused.contains("line 2") && refused.contains("rotation"), "{refused}");
    }

    #[test]
    fn faults_name_file_line_and_way_out() {
        for (file, text, expected) in [
            ("pairs.csv", "source,target\n".to_owned(), "no column `overlap`"),
            ("pairs.csv", format!("{HEADER}\nb,a,x,1,0,0,0,0,1,0,0,0,0,1,0\n"), "line 2: `x` is not a finite number"),
            ("pairs.csv", format!("{HEADER}\nb,a,1\n"), "line 2: holds 3 fields"),
            ("dataset.toml", "name = 'x'\nlicense = 'y'\n".to_owned(), "unknown field `license`"),
        ] {
            let folder = folder(&[(file, &text)]);
            let message = read_dataset(folder.path(), None).unwrap_err().to_string();
            assert!(message.contains(file) && message.contains(expected), "{message}");
        }
    }
}
