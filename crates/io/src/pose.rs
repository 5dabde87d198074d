//! Poses as text: a 4×4 matrix, row by row, sixteen numbers parted by white space.

use crate::error::excerpt;
use crate::read::bytes_of;
use crate::{IoError, Motion, MotionFault, write_file};
use congruent_geometry::{RigidTransform, to_rows};
use std::path::Path;

/// Why a text is no pose. Lines count from one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseFault {
    /// A word is no number.
    #[error("line {line}: `{token}` is not a number; a pose is 16 numbers, the 4x4 matrix row by row")]
    NotANumber {
        /// Where.
        line: usize,
        /// The word.
        token: String,
    },
    /// Too few numbers, or too many.
    #[error("holds {found} numbers; a pose is 16, the 4x4 matrix row by row")]
    Count {
        /// How many there are.
        found: usize,
    },
    /// The matrix is no rigid motion.
    #[error(transparent)]
    Matrix(#[from] MotionFault),
}

/// Writes a pose as four lines of four numbers. Every digit is kept; see [`write_file`] for how the file is replaced.
///
/// # Errors
/// The file cannot be written.
pub fn write_pose(path: &Path, pose: &RigidTransform) -> Result<(), IoError> {
    let line = |row: [f64; 4]| row.map(|v| format!("{v:?}")).join(" ") + "\n";
    write_file(path, to_rows(pose).map(line).concat().as_bytes())
}

/// Reads a 4×4 matrix, row by row, and returns the nearest rigid motion. How it is cut into lines does not matter.
///
/// # Errors
/// The file cannot be read, does not hold sixteen numbers, or is farther than 1e-3 from a rigid motion.
///
/// # Examples
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("target_from_source.txt");
/// std::fs::write(&path, "1 0 0 0.5\n0 1 0 0\n0 0 1 -2\n0 0 0 1\n")?;
/// let target_from_source = congruent_io::read_pose(&path)?;
/// assert_eq!(target_from_source.translation.vector.z, -2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_pose(path: &Path) -> Result<RigidTransform, IoError> {
    let text = bytes_of(path)?;
    parse(&String::from_utf8_lossy(&text)).map_err(|fault| IoError::Pose { path: path.to_owned(), fault })
}

fn parse(text: &str) -> Result<RigidTransform, PoseFault> {
    let mut numbers = Vec::with_capacity(16);
    for (line, content) in (1..).zip(text.lines()) {
        for token in content.split_whitespace() {
            let fault = || PoseFault::NotANumber { line, token: excerpt(token.as_bytes()) };
            numbers.push(token.parse::<f64>().map_err(|_| fault())?);
        }
    }
    let found = numbers.len();
    let sixteen: [f64; 16] = numbers.try_into().map_err(|_| PoseFault::Count { found })?;
    let rows: [[f64; 4]; 4] = std::array::from_fn(|row| std::array::from_fn(|column| sixteen[4 * row + column]));
    Ok(Motion::nearest(&rows, Motion::WARN_ABOVE)?.pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    fn example(item: u64) -> RigidTransform {
        let mut stream = Stream::new(5, item);
        let translation = [stream.between(-1e6, 1e6), stream.between(-1.0, 1.0), stream.between(-1e-9, 1e-9)];
        RigidTransform::from_parts(translation.into(), stream.rotation())
    }

    #[test]
    fn poses_survive_the_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pose.txt");
        for item in 0..50 {
            let pose = example(item);
            write_pose(&path, &pose).unwrap();
            let back = read_pose(&path).unwrap();
            assert_eq!(back.translation, pose.translation);
            assert!(back.rotation.angle_to(&pose.rotation) < 1e-12);
        }
    }

    #[test]
    fn six_digits_and_any_line_ends_are_enough() {
        let pose = example(1);
        for ends in ["\n", "\r\n", " ", "\t"] {
            let text: String = to_rows(&pose).iter().flatten().map(|v| format!("{v:.6}{ends}")).collect();
            assert!(parse(&text).unwrap().rotation.angle_to(&pose.rotation) < 1e-5);
        }
    }

    #[test]
    fn texts_that_are_no_pose_say_why() {
        let check = |text: &str, expected: &[&str]| {
            let message = parse(text).unwrap_err().to_string();
            for fragment in expected {
                assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
            }
        };
        check("1 0 0 0\n0 1 0 zero", &["line 2", "`zero`", "16 numbers"]);
        check(" \n", &["holds 0 numbers"]);
        check(&"1 ".repeat(17), &["holds 17 numbers"]);
        check("1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1", &["last row", "[5.0, 6.0, 7.0, 1.0]", "row by row"]);
        check("1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 nan", &["last row"]);
        check("2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 1", &["rotation", "remove scale"]);
        check("-1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1", &["mirroring"]);
        check("1 0 0 inf  0 1 0 0  0 0 1 0  0 0 0 1", &["rotation"]);
    }

    #[test]
    fn the_path_comes_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pose.txt");
        std::fs::write(&path, "1 2 3").unwrap();
        let message = read_pose(&path).unwrap_err().to_string();
        assert!(message.starts_with(&format!("{}: holds 3 numbers", path.display())), "{message}");
    }
}
