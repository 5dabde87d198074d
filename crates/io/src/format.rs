//! Which format a file is in.
//!
//! A further format is one module with a test of the first bytes and a reader, a variant, and its row in each match.

use crate::{IoError, ply};
use congruent_geometry::RawScan;
use std::path::Path;

/// A scan format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Polygon File Format, also called Stanford Triangle Format.
    Ply,
}

impl Format {
    const ALL: [Format; 1] = [Format::Ply];

    /// The format of a file's content, whatever its name ends in.
    pub(crate) fn recognise(path: &Path, bytes: &[u8]) -> Result<Format, IoError> {
        Format::ALL.into_iter().find(|format| format.matches(bytes)).ok_or_else(|| IoError::UnknownFormat {
            path: path.to_owned(),
            extension: path.extension().map_or("none".into(), |e| e.to_string_lossy().into_owned()),
            supported: Format::ALL.map(Format::name).join(", "),
        })
    }

    /// Reads a file of this format; `path` is for messages only.
    pub(crate) fn read(self, path: &Path, bytes: &[u8]) -> Result<RawScan, IoError> {
        match self {
            Format::Ply => ply::read(bytes).map_err(|fault| IoError::Ply { path: path.to_owned(), fault }),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Format::Ply => "PLY",
        }
    }

    fn matches(self, bytes: &[u8]) -> bool {
        match self {
            Format::Ply => ply::is_ply(bytes),
        }
    }
}
