//! Data sets: which scans belong together, and the true motions between them.
//!
//! A folder with `pairs.csv` and `scans/` is a data set as it is. Any other layout is described by a `dataset.toml`.

mod about;
mod gt_log;
mod lines;
mod pair_table;
mod pairs_csv;
mod pose_list;
mod stanford;
mod views;
mod xf_folder;

pub use about::{About, PairsAbout, TruthAbout, TruthFormat};
pub use lines::DatasetFault;
pub use pair_table::{PairColumns, PairEntry, pair_table};
pub use pairs_csv::{PairLine, pairs_csv};

use crate::read::bytes_of;
use crate::{IoError, Motion};
use congruent_geometry::RigidTransform;
use std::path::{Path, PathBuf};

/// Pairs of scans with their truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// What it is called.
    pub name: String,
    /// In the order of its ground truth.
    pub pairs: Vec<TruePair>,
    /// What is odd about the ground truth, for the user to read.
    pub warnings: Vec<String>,
    /// Pairs whose truth cannot be used: a message for each, with file and line.
    pub broken: Vec<String>,
    /// The files that it was read from: its description, if it has one, and its ground truth.
    pub read_from: Vec<PathBuf>,
    /// Pairs that share less than this belong to the data set only where somebody asks for them.
    pub min_overlap: f64,
}

/// Two scan files and the motion between them.
#[derive(Clone, Debug, PartialEq)]
pub struct TruePair {
    /// Unique name of the pair, where the data set gives one; after the name of its scene where there are scenes.
    pub id: Option<String>,
    /// As the data set names it, after the name of its scene where there are scenes.
    pub source: String,
    /// As the data set names it.
    pub target: String,
    /// Where the pair is named: file and line, or the file of a folder.
    pub place: String,
    /// Where the source is.
    pub source_file: PathBuf,
    /// Where the target is.
    pub target_file: PathBuf,
    /// Share of points that both have, where the data set says so.
    pub overlap: Option<f64>,
    /// The truth, projected onto rigid motions.
    pub target_from_source: RigidTransform,
}

/// Reads a folder, or a `dataset.toml`. `data` is where the files are, if not beside the description. A pair that cannot be
/// used does not spoil the others, nor does a scene that is not there.
///
/// # Errors
/// The description or the ground truth cannot be read or breaks its format, or not one pair can be used. Scans are not
/// opened.
pub fn read_dataset(path: &Path, data: Option<&Path>) -> Result<Dataset, IoError> {
    let description = if path.is_dir() { path.join("dataset.toml") } else { path.to_owned() };
    let about = if path.is_dir() && !description.exists() {
        About::plain(path)
    } else {
        About::parse(&text_of(&description)?).map_err(|fault| IoError::Dataset { path: description.clone(), fault })?
    };
    let root = data.unwrap_or_else(|| if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) });
    let min_overlap = about.pairs.min_overlap;
    let (name, read_from) = (about.name.clone(), description.exists().then_some(description).into_iter().collect());
    let mut dataset = Dataset { name, pairs: vec![], warnings: vec![], broken: vec![], read_from, min_overlap };
    let scenes = if about.scenes.is_empty() { vec![None] } else { about.scenes.iter().map(Some).collect() };
    let mut first_fault = None;
    for scene in scenes {
        let layout = Layout::new(&about, root, scene.map(String::as_str));
        dataset.read_from.extend(layout.files());
        let listed = layout.listed(&about.truth).unwrap_or_else(|error| vec![Err(error)]);
        for truth in listed {
            match truth {
                Ok(truth) => dataset.add(truth, &layout, about.truth.inverted),
                Err(error) => {
                    dataset.broken.push(error.to_string());
                    first_fault = first_fault.or(Some(error));
                }
            }
        }
    }
    match first_fault {
        Some(fault) if dataset.pairs.is_empty() => Err(fault),
        _ => Ok(dataset),
    }
}

/// Where the files of a data set are, or of one of its scenes.
struct Layout {
    scene: Option<String>,
    scans: PathBuf,
    truth: PathBuf,
}

impl Layout {
    fn new(about: &About, root: &Path, scene: Option<&str>) -> Layout {
        let place = |path: &Path| match scene {
            Some(scene) => root.join(path.to_string_lossy().replace("{scene}", scene)),
            None => root.join(path),
        };
        Layout { scene: scene.map(str::to_owned), scans: place(&about.scans), truth: place(&about.truth.path) }
    }

    fn listed(&self, about: &TruthAbout) -> Result<Listed<IoError>, IoError> {
        let place = &self.truth;
        let faulty = |fault| IoError::Dataset { path: place.clone(), fault };
        let each = |listed: Listed| listed.into_iter().map(|truth| truth.map_err(faulty)).collect();
        Ok(match about.format {
            TruthFormat::PairsCsv => each(pairs_csv::parse(&text_of(place)?).map_err(faulty)?),
            TruthFormat::PoseList => each(pose_list::parse(&text_of(place)?)),
            TruthFormat::GtLog => each(gt_log::parse(&text_of(place)?, &about.names)),
            TruthFormat::StanfordConf => each(stanford::parse(&text_of(place)?)),
            TruthFormat::XfFolder => xf_folder::read_pairs(place, &about.names)?,
            TruthFormat::XfViews => xf_folder::read_views(place, &about.names)?,
        })
    }

    /// The files of the truth.
    fn files(&self) -> Vec<PathBuf> {
        if self.truth.is_dir() {
            return xf_folder::files(&self.truth).unwrap_or_default();
        }
        vec![self.truth.clone()]
    }

    /// What a scan or a pair is called among all scenes.
    fn name(&self, name: String) -> String {
        self.scene.as_ref().map_or(name.clone(), |scene| format!("{scene}/{name}"))
    }
}

impl Dataset {
    fn add(&mut self, truth: Truth, layout: &Layout, inverted: bool) {
        let Truth { id, source, target, place, overlap, motion } = truth;
        let place = format!("{}: {place}", layout.truth.display());
        let Motion { pose, skew } = motion;
        if motion.is_skewed() {
            self.warnings.push(format!(
                "{place}: {source} to {target}: the true motion is {skew:.1e} away from a rigid one; the nearest rigid \
                 one is used"
            ));
        }
        let target_from_source = if inverted { pose.inverse() } else { pose };
        let (source_file, target_file) = (layout.scans.join(&source), layout.scans.join(&target));
        let (source, target) = (layout.name(source), layout.name(target));
        let id = id.map(|id| layout.name(id));
        self.pairs.push(TruePair { id, source, target, place, source_file, target_file, overlap, target_from_source });
    }
}

fn text_of(path: &Path) -> Result<String, IoError> {
    let bytes = bytes_of(path)?;
    String::from_utf8(bytes).map_err(|_| IoError::Dataset { path: path.to_owned(), fault: DatasetFault::NotText })
}

/// What a ground truth lists: pairs, and what is wrong with those that cannot be used.
type Listed<E = DatasetFault> = Vec<Result<Truth, E>>;

/// One pair as the ground truth names it.
#[derive(Clone, Debug, PartialEq)]
struct Truth {
    id: Option<String>,
    source: String,
    target: String,
    /// Where in the truth it is named: a line, or a file of the folder.
    place: String,
    overlap: Option<f64>,
    motion: Motion,
}

#[cfg(test)]
mod tests;
