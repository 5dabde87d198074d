//! A folder of matrices: one file for each pair, as the scenes of the University of Western Australia come, or one for each
//! scan, as programs that align many views leave them.

use super::lines::{lines, motion, numbers};
use super::views::{View, all_pairs};
use super::{DatasetFault, Listed, Truth, text_of};
use crate::{IoError, Motion};
use std::path::{Path, PathBuf};

/// Reads every `SOURCE-TARGET.xf`, in the order of the names. `names` is what scans are called, `{}` being the name.
pub(super) fn read_pairs(folder: &Path, names: &str) -> Result<Listed<IoError>, IoError> {
    Ok(files(folder)?.iter().map(|file| pair(file, names)).collect())
}

/// Reads every `SCAN.xf`, which maps that scan into the common frame; all pairs, in the order of the names.
pub(super) fn read_views(folder: &Path, names: &str) -> Result<Listed<IoError>, IoError> {
    let view = |file: &PathBuf| {
        let Motion { pose, skew } = motion_in(file)?;
        Ok(View { name: names.replace("{}", &stem(file)), place: name(file), world_from_scan: pose, skew })
    };
    Ok(all_pairs(files(folder)?.iter().map(view)))
}

/// The matrices in a folder, in the order of their names.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let refused = |reason| IoError::Read { path: folder.to_owned(), reason };
    let entries = std::fs::read_dir(folder).map_err(refused)?;
    let mut files: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_, _>>().map_err(refused)?;
    files.retain(|file| file.extension().is_some_and(|extension| extension == "xf"));
    files.sort();
    Ok(files)
}

fn name(file: &Path) -> String {
    file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn stem(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

fn pair(file: &Path, names: &str) -> Result<Truth, IoError> {
    let stem = stem(file);
    let parts = stem.rsplit_once('-');
    let fault = DatasetFault::Name;
    let (source, target) = parts.ok_or_else(|| IoError::Dataset { path: file.to_owned(), fault })?;
    let scan = |part: &str| names.replace("{}", part);
    Ok(Truth {
        id: None,
        source: scan(source),
        target: scan(target),
        place: name(file),
        overlap: None,
        motion: motion_in(file)?,
    })
}

fn motion_in(file: &Path) -> Result<Motion, IoError> {
    let faulty = |fault| IoError::Dataset { path: file.to_owned(), fault };
    let matrix = matrix(&text_of(file)?).map_err(faulty)?;
    motion(&matrix, 1).map_err(faulty)
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
    use super::super::tests::whole;

    #[test]
    fn files_are_named_after_their_pair() {
        let folder = tempfile::TempDir::new().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("t-rex-rs2.xf", "1 0 0 4\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        write("chef-rs1.xf", "1 0 0 3\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        write("readme.txt", "not a pose");
        let read = whole(super::read_pairs(folder.path(), "{}.ply").unwrap());
        let names: Vec<_> = read.iter().map(|t| (t.source.as_str(), t.target.as_str())).collect();
        assert_eq!(names, [("chef.ply", "rs1.ply"), ("t-rex.ply", "rs2.ply")]);
        assert_eq!(read[1].motion.pose.translation.vector.x, 4.0);
        write("chef.xf", "1 0 0 3\n");
        write("t-rex-rs2.xf", "1 0 0 4\n0 inf 0 0\n0 0 1 0\n0 0 0 1\n");
        let read = super::read_pairs(folder.path(), "{}.ply").unwrap();
        let messages: Vec<String> = read.iter().filter_map(|r| Some(r.as_ref().err()?.to_string())).collect();
        assert_eq!((read.len(), messages.len()), (3, 2), "the whole one is still there");
        assert!(messages[0].contains("chef.xf") && messages[0].contains("SOURCE-TARGET"), "{messages:?}");
        assert!(messages[1].contains("t-rex-rs2.xf") && messages[1].contains("line 2"), "{messages:?}");
    }

    #[test]
    fn a_file_for_each_scan_makes_all_pairs() {
        let folder = tempfile::TempDir::new().unwrap();
        for (name, x) in [("a", 1), ("b", 5), ("c", 11)] {
            let text = format!("1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
            std::fs::write(folder.path().join(format!("{name}.xf")), text).unwrap();
        }
        let read = whole(super::read_views(folder.path(), "{}.ply").unwrap());
        let found: Vec<_> =
            read.iter().map(|t| (t.source.as_str(), t.target.as_str(), t.motion.pose.translation.vector.x)).collect();
        assert_eq!(found, [("b.ply", "a.ply", 4.0), ("c.ply", "a.ply", 10.0), ("c.ply", "b.ply", 6.0)]);
    }
}
