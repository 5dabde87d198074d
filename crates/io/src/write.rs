//! Writing a file whole or not at all.

use crate::IoError;
use congruent_geometry::Coordinates;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Puts a file in place, whole or not at all: the bytes go to a temporary file in the same folder, which then takes
/// the name. An existing file is replaced and keeps its permissions, a symbolic link is followed, a device or pipe
/// is written to directly.
///
/// # Errors
/// The folder is missing or may not be written to, the disk is full, or the path is a directory. The temporary file
/// is removed and a file that was there before is untouched.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    put(path, bytes).map_err(|reason| IoError::Write { path: path.to_owned(), reason })
}

/// Whether coordinates lose nothing as `f32`.
pub(crate) fn fits_float(points: &Coordinates) -> bool {
    match points {
        Coordinates::Single(_) => true,
        Coordinates::Double(points) => points.iter().flatten().all(|&v| v.is_nan() || f64::from(v as f32) == v),
    }
}

fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let target = destination(path);
    let there = fs::metadata(&target).ok();
    match &there {
        Some(there) if there.is_dir() => return Err(io::Error::new(ErrorKind::IsADirectory, "it is a directory")),
        Some(there) if !there.is_file() => return fs::write(&target, bytes),
        _ => {}
    }
    let folder = target.parent().unwrap_or(Path::new(""));
    let (temporary, mut file) = temporary_in(folder)?;
    if let Some(there) = there {
        // Some file systems have none to set.
        let _ = file.set_permissions(there.permissions());
    }
    let written = file.write_all(bytes);
    drop(file); // Some systems do not rename an open file.
    let placed = written.and_then(|()| fs::rename(&temporary, &target));
    if placed.is_err() {
        // The first failure is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    placed
}

/// Where a path leads: the end of its links, whether there is a file yet or not.
fn destination(path: &Path) -> PathBuf {
    if let Ok(existing) = fs::canonicalize(path) {
        return existing;
    }
    let beside = |link: PathBuf| path.parent().map_or_else(|| link.clone(), |folder| folder.join(&link));
    fs::read_link(path).map_or_else(|_| path.to_owned(), beside)
}

/// A new file that nobody else has. Its name does not hold the target's, which may be as long as a name can be.
fn temporary_in(folder: &Path) -> io::Result<(PathBuf, File)> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!(".congruent-{}-{number}.tmp", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            // Left behind by a killed process of the same number, or held by one on another machine.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_and_nothing_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        write_file(&path, b"old and longer").unwrap();
        write_file(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names_in(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_failure_names_the_path_and_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        for path in [taken.clone(), folder.path().join("absent").join("result.json"), taken.join("..")] {
            let message = write_file(&path, b"x").unwrap_err().to_string();
            assert!(message.starts_with(&path.display().to_string()), "{message}");
            assert!(message.contains("check that its folder exists"), "{message}");
        }
        assert_eq!(names_in(folder.path()), ["taken"]);
    }

    #[test]
    fn threads_that_write_one_file_leave_one_of_their_contents() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shared");
        std::thread::scope(|scope| {
            for content in [[b'a'; 4096], [b'b'; 4096], [b'c'; 4096]] {
                let path = &path;
                scope.spawn(move || (0..20).for_each(|_| write_file(path, &content).unwrap()));
            }
        });
        let content = fs::read(&path).unwrap();
        assert!(content.len() == 4096 && content.iter().all(|&b| b == content[0]));
        assert_eq!(names_in(folder.path()), ["shared"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_nothing_yet_is_followed_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (link, end) = (folder.path().join("link"), folder.path().join("end"));
        std::os::unix::fs::symlink("end", &link).unwrap();
        write_file(&link, b"through").unwrap();
        assert_eq!(fs::read(&end).unwrap(), b"through");
        fs::set_permissions(&end, fs::Permissions::from_mode(0o600)).unwrap();
        write_file(&link, b"again").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&end).unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, b"old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_file(&link, b"new").unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
