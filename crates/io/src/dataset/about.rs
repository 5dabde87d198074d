//! `dataset.toml`: what a data set is and how its files are laid out.

use super::DatasetFault;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A description. What is said about unit, licence and origin is for people.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct About {
    /// What it is called.
    pub name: String,
    /// What it shows.
    #[serde(default)]
    pub about: String,
    /// Of the coordinates.
    #[serde(default)]
    pub unit: String,
    /// What may be done with it.
    #[serde(default)]
    pub licence: String,
    /// Where to get it.
    #[serde(default)]
    pub source: String,
    /// Parts that are laid out alike, each in folders of its own: `{scene}` in `scans` and in the path of the truth stands
    /// for their names.
    #[serde(default)]
    pub scenes: Vec<String>,
    /// Folder of the scans.
    #[serde(default = "scans")]
    pub scans: PathBuf,
    /// Which pairs are the data set.
    #[serde(default)]
    pub pairs: PairsAbout,
    /// Where the true motions are.
    pub truth: TruthAbout,
}

/// Which of the pairs that have a truth are the data set.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PairsAbout {
    /// Those that share at least this much of their points under the truth, 0 to 1: the smaller of both directions.
    #[serde(default)]
    pub min_overlap: f64,
}

/// Where the true motions are and how they are written.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TruthAbout {
    /// How they are written.
    pub format: TruthFormat,
    /// A file, or a folder for `xf-folder` and `xf-views`.
    pub path: PathBuf,
    /// Where the truth gives no file names: what a scan is called, `{}` being its number or name.
    #[serde(default = "names")]
    pub names: String,
    /// The truth maps target to source.
    #[serde(default)]
    pub inverted: bool,
}

/// How true motions are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TruthFormat {
    /// Our own: a header, then a line a pair with file names, overlap and the upper three rows of the matrix.
    PairsCsv,
    /// A line a pair: source, target, and the sixteen numbers of the matrix.
    PoseList,
    /// Redwood and 3DMatch: a line `i j n`, then the matrix that maps scan j into the frame of scan i.
    GtLog,
    /// Stanford: a pose for each scan; all pairs of scans.
    StanfordConf,
    /// A file `SOURCE-TARGET.xf` for each pair, holding the matrix.
    XfFolder,
    /// A file `SCAN.xf` for each scan, holding the matrix into a common frame; all pairs of scans.
    XfViews,
}

impl About {
    /// Of a folder without a description.
    pub(super) fn plain(folder: &Path) -> About {
        let full = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        About {
            name: full.file_name().map_or("dataset".to_owned(), |name| name.to_string_lossy().into_owned()),
            about: String::new(),
            unit: String::new(),
            licence: String::new(),
            source: String::new(),
            scenes: Vec::new(),
            scans: scans(),
            pairs: PairsAbout::default(),
            truth: TruthAbout {
                format: TruthFormat::PairsCsv,
                path: "pairs.csv".into(),
                names: names(),
                inverted: false,
            },
        }
    }

    pub(super) fn parse(text: &str) -> Result<About, DatasetFault> {
        toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text.get(..span.start).unwrap_or(text).matches('\n').count());
            DatasetFault::Description { line, message: error.message().trim().to_owned() }
        })
    }
}

fn scans() -> PathBuf {
    "scans".into()
}

fn names() -> String {
    "{}.ply".to_owned()
}
