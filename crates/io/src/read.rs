//! From a path to a scan.

use crate::IoError;
use crate::content::Content;
use crate::format::Format;
use crate::gathered::Keep;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::path::Path;

/// Reads a scan: points, normals where the file has all three components, faces cut into triangles.
///
/// The format is recognised by the content, not by the name; the name only settles what the content leaves open.
/// * PLY: ASCII or binary, points or meshes, any scalar types.
/// * PCD: text, binary or compressed; points that are NaN stay.
/// * OBJ and OFF as text, STL as text or binary (corners at one place become one point).
/// * XYZ, TXT, CSV: lines of numbers parted by semicolons, commas, tabs or spaces, with or without a header line. The first
///   three columns are x, y and z; the next three are normals where they have length one in every line.
/// * LAS and LAZ: coordinates from scale and offset.
/// * E57: all scans of the file, each moved by its pose, as one.
///
/// A file is never in memory as a whole, only its points are: 12 bytes each from a binary file of `f32`, 24 from any other,
/// 12 more with a normal, and 12 for each triangle. An OBJ file is gone through twice, because faces may come before their
/// vertices. A pipe is taken into memory first.
///
/// [`RawScan::viewpoint`] comes from a PLY file's camera or comments (`view_px view_py view_pz`), from a PCD file's
/// `VIEWPOINT` and from the pose of an E57 file's only scan, where these are not just the default.
///
/// Coordinates stay in the file's units and frame; NaN and infinite ones are passed on for
/// [`Scan::new`](congruent_geometry::Scan::new) to drop and count. A file may hold no points at all.
///
/// # Errors
/// The file cannot be read, is in no supported format, or breaks its format; the message says where and what to do.
///
/// # Examples
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("square.ply");
/// std::fs::write(
///     &path,
///     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
///      element face 1\nproperty list uchar int vertex_indices\nend_header\n\
///      0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n",
/// )?;
/// let scan = congruent_io::read_scan(&path)?;
/// assert_eq!(scan.points.at(2), [1.0, 1.0, 0.0]);
/// assert_eq!(scan.triangles, [[0, 1, 2], [0, 2, 3]]);
///
/// let error = congruent_io::read_scan(&folder.path().join("absent.ply")).unwrap_err();
/// assert!(error.to_string().contains("absent.ply: cannot be read"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_scan(path: &Path) -> Result<RawScan, IoError> {
    scan_in(path, Content::open(path)?, Keep::All)
}

/// Reads a scan as [`read_scan`] does and keeps one point for each occupied cubic cell of side `leaf` (file units): the one
/// nearest to the cell's centre, with its normal. Cells are `floor(x / leaf)` on each axis; points that are not finite are
/// dropped.
///
/// A file of points is thinned while it is read, so that memory is needed for the points that are kept, some 100 bytes each,
/// and not for the others. A mesh is read whole: the corners of its triangles become the points kept of their cells, and
/// triangles of which two corners then coincide are dropped.
///
/// Which points are kept does not depend on their order in the file.
///
/// # Errors
/// Those of [`read_scan`].
///
/// # Panics
/// If the leaf is not a positive number.
///
/// # Examples
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("points.xyz");
/// std::fs::write(&path, "0.1 0.5 0.5\n0.4 0.5 0.5\n0.9 0.5 0.5\n1.2 0.5 0.5\n")?;
/// let scan = congruent_io::read_scan_thinned(&path, 1.0)?;
/// assert_eq!(scan.points, [[0.4, 0.5, 0.5], [1.2, 0.5, 0.5]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_scan_thinned(path: &Path, leaf: f64) -> Result<RawScan, IoError> {
    assert!(leaf > 0.0, "a cell has a side above zero, not {leaf}");
    scan_in(path, Content::open(path)?, Keep::OnePerCell(leaf))
}

/// The scan in a file's content; `path` is for messages only.
pub(crate) fn scan_in(path: &Path, content: Content, keep: Keep) -> Result<RawScan, IoError> {
    let failure = content.failure();
    let window = Window::new(content);
    let scan = Format::recognise(path, &window).and_then(|format| format.read(path, window, keep));
    match failure.take() {
        Some(reason) => Err(IoError::Read { path: path.to_owned(), reason }),
        None => scan,
    }
}

/// The same of what is in memory.
#[cfg(test)]
pub(crate) fn scan_from(path: &Path, bytes: &[u8]) -> Result<RawScan, IoError> {
    scan_in(path, Content::of(bytes.to_vec()), Keep::All)
}

/// A file's content, at least one byte.
pub(crate) fn bytes_of(path: &Path) -> Result<Vec<u8>, IoError> {
    match std::fs::read(path) {
        Ok(bytes) if bytes.is_empty() => Err(IoError::Empty { path: path.to_owned() }),
        Ok(bytes) => Ok(bytes),
        // Asked only now: the error a directory gives differs from system to system.
        Err(_) if path.is_dir() => Err(IoError::Directory { path: path.to_owned() }),
        Err(reason) => Err(IoError::Read { path: path.to_owned(), reason }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(path: &Path, expected: &[&str]) {
        let message = read_scan(path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()), "{message}");
        for fragment in expected {
            assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
        }
    }

    #[test]
    fn files_that_are_no_scans_are_named_with_a_way_out() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, content: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, content).unwrap();
            path
        };
        check(&folder.path().join("absent.ply"), &["cannot be read", "check the path"]);
        check(folder.path(), &["is a directory", "give the path of a file"]);
        check(&file("void.ply", b""), &["is empty", "export it again"]);
        check(
            &file("scan.docx", b"PK\x03\x04"),
            &["not in a supported format", "extension: docx", "convert it to PLY, OBJ"],
        );
        check(&file("scan", b"1 2"), &["extension: none", "PLY"]);
        check(&file("short.ply", b"pl"), &["extension: ply"]);
        check(&file("plywood.txt", b"plywood\n"), &["extension: txt"]);
    }

    #[test]
    fn the_content_decides_not_the_extension() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.txt");
        crate::write_ply(&path, &vec![[1.0, 2.0, 3.0]].into(), None, &[]).unwrap();
        assert_eq!(read_scan(&path).unwrap().points, [[1.0, 2.0, 3.0]]);
    }
}
