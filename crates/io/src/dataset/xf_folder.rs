//! A folder of matrices, one file for each pair, as the scenes of the University of Western Australia come.

use super::lines::{lines, numbers};
use super::{DatasetFault, Motion, Truth, text_of};
use crate::IoError;
use std::path::{Path, PathBuf};

/// Reads every `SOURCE-TARGET.xf`, in the order of the names. `names` is what scans are called, `{}` being the name.
pub(super) fn read(folder: &Path, names: &str) -> Result<Vec<Truth>, IoError> {
    let refused = |reason| IoError::Read { path: folder.to_owned(), reason };
    let entries = std::fs::read_dir(folder).map_err(refused)?;
    let mut files: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_, _>>().map_err(refused)?;
    files.retain(|file| file.extension().is_some_and(|extension| extension == "xf"));
    files.sort();
    files.iter().map(|file| one(file, names)).collect()
}

fn one(file: &Path, names: &str) -> Result<Truth, IoError> {
    let faulty = |fault| IoError::Dataset { path: file.to_owned(), fault };
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let (source, target) = stem.rsplit_once('-').ok_or_else(|| faulty(DatasetFault::Name))?;
    let matrix = matrix(&text_of(file)?).map_err(faulty)?;
    let name = |part: &str| names.replace("{}", part);
    let motion = Motion::new(&matrix, 1).map_err(faulty)?;
    Ok(Truth { source: name(source), target: name(target), overlap: None, motion })
}

fn matrix(text: &str) -> Result<Vec<f64>, DatasetFault> {
    let mut matrix = Vec::with_capacity(16);
    for (line, content) in lines(text) {
        matrix.extend(numbers(&content.split_whitespace().collect::<Vec<_>>(), line)?);
    }
    let expected = "a pose is 16 numbers, the 4x4 matrix row by row";
    if matrix.len() == 16 { Ok(matrix) } else { Err(DatasetFault::Width { line: 1, found: matrix.len(), expected }) }
}

#[cfg(test)]
mod tests {
    #[test]
    fn files_are_named_after_their_pair() {
        let folder = tempfile::TempDir::new().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("t-rex-rs2.xf", "1 0 0 4\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        write("chef-rs1.xf", "1 0 0 3\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        write("readme.txt", "not a pose");
        let read = super::read(folder.path(), "{}.ply").unwrap();
        let names: Vec<_> = read.iter().map(|t| (t.source.as_str(), t.target.as_str())).collect();
        assert_eq!(names, [("chef.ply", "rs1.ply"), ("t-rex.ply", "rs2.ply")]);
        assert_eq!(read[1].motion.pose.translation.vector.x, 4.0);
        write("chef.xf", "1 0 0 3\n");
        let message = super::read(folder.path(), "{}.ply").unwrap_err().to_string();
        assert!(message.contains("chef.xf") && message.contains("SOURCE-TARGET"), "{message}");
    }
}
