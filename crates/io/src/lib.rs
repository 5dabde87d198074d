//! Scan files, poses, data sets, and what the stages of the chain leave: the only library of Congruent that opens files.
//!
//! [`read_scan`] recognises a file by its content and returns its points, normals and triangles unchanged.
//! [`write_scan`], [`write_ply`], [`write_pose`] and [`write_file`] put a whole file in place or leave everything as it
//! was. Memory follows the size of a file, never a number in its header, and no content makes a reader panic.

mod blanked;
mod content;
mod csv;
mod dataset;
mod e57;
mod error;
mod format;
mod gathered;
mod las;
mod motion;
mod npy;
mod obj;
mod off;
mod pcd;
mod ply;
mod pose;
mod read;
mod stages;
mod stl;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod window;
mod write;
mod write_scan;
mod xyz;

pub use csv::{csv_fields, csv_line};
pub use dataset::{
    About, Dataset, DatasetFault, PairColumns, PairEntry, PairLine, PairsAbout, TruePair, TruthAbout, TruthFormat,
    pair_table, pairs_csv, read_dataset,
};
pub use error::IoError;
pub use motion::{Motion, MotionFault};
pub use npy::{Matrix, NpyFault, read_npy, write_npy};
pub use ply::{PlyFault, write_coloured_ply, write_ply};
pub use pose::{PoseFault, read_pose, write_pose};
pub use read::{read_scan, read_scan_thinned};
pub use stages::{
    KeypointRow, MatchRow, Place, PoseRow, keypoints_csv, matches_csv, places_csv, poses_csv, read_matches, read_places,
};
pub use table::TableFault;
pub use write::write_file;
pub use write_scan::{Loss, Written, check_scan_name, write_scan};
