//! What the readers of ground truth share.

use crate::error::excerpt;
use crate::{Motion, MotionFault};

/// Why a description or ground truth cannot be used. Lines count from one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DatasetFault {
    /// The bytes are no text.
    #[error("is not UTF-8 text; export it again as plain text")]
    NotText,
    /// `dataset.toml` is not what it should be.
    #[error("line {line}: {message}; see the files in datasets/ for examples")]
    Description {
        /// Where.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A table of pairs has no line.
    #[error("is empty; name the columns source,target in the first line")]
    NoHeader,
    /// A column is missing.
    #[error(
        "there is no column `{missing}` among `{found}`; the header should be \
         source,target,overlap,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz, where only source,target are needed"
    )]
    Column {
        /// Its name.
        missing: String,
        /// The header.
        found: String,
    },
    /// A pair has an empty name.
    #[error("line {line}: source, target and id must not be empty; correct the line or remove it")]
    NoName {
        /// Where.
        line: usize,
    },
    /// A pair of a data set has no true pose.
    #[error(
        "line {line}: there is no true pose; fill in r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz or remove the line"
    )]
    NoTruth {
        /// Where.
        line: usize,
    },
    /// A field of a named column is no finite number.
    #[error("line {line}: `{token}` in the column `{column}` is not a finite number; correct the line or remove it")]
    Field {
        /// Where.
        line: usize,
        /// The name of its column.
        column: String,
        /// The field.
        token: String,
    },
    /// One of the matrices of a pair is far from a rigid motion.
    #[error("line {line}: the {pose}: {fault}")]
    Pose {
        /// Where.
        line: usize,
        /// What it is.
        pose: &'static str,
        /// What is wrong with it.
        fault: MotionFault,
    },
    /// Fields are missing, or too many.
    #[error("line {line}: has {found} fields; {expected}")]
    Width {
        /// Where.
        line: usize,
        /// Fields there are.
        found: usize,
        /// What a line should hold.
        expected: &'static str,
    },
    /// A field is no finite number.
    #[error("line {line}: `{token}` is not a finite number; correct the line or remove it")]
    NotANumber {
        /// Where.
        line: usize,
        /// The field.
        token: String,
    },
    /// The file ends in the middle of a matrix.
    #[error("ends inside the matrix that begins after line {line}; copy the file again")]
    Cut {
        /// Of the pair.
        line: usize,
    },
    /// A matrix is far from a rigid motion.
    #[error("line {line}: {fault}")]
    Matrix {
        /// Where.
        line: usize,
        /// What is wrong with it.
        fault: MotionFault,
    },
    /// A quaternion has no direction.
    #[error("line {line}: the quaternion is zero; a rotation has one of length 1")]
    NoRotation {
        /// Where.
        line: usize,
    },
    /// A name in a folder of poses is not SOURCE-TARGET.
    #[error("the name should be SOURCE-TARGET.xf; rename it or move it out of the folder")]
    Name,
}

/// Lines with something on them, with their numbers.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    (1..).zip(text.lines().map(str::trim)).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// What a line is called as a place.
pub(super) fn at_line(line: usize) -> String {
    format!("line {line}")
}

pub(super) fn number(token: &str, line: usize) -> Result<f64, DatasetFault> {
    let value = token.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| DatasetFault::NotANumber { line, token: excerpt(token.as_bytes()) })
}

/// The motion of the sixteen numbers of a matrix, row by row.
pub(super) fn motion(numbers: &[f64], line: usize) -> Result<Motion, DatasetFault> {
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| numbers[4 * row + column]));
    Motion::nearest(&rows, Motion::REFUSE_ABOVE).map_err(|fault| DatasetFault::Matrix { line, fault })
}

pub(super) fn numbers(tokens: &[&str], line: usize) -> Result<Vec<f64>, DatasetFault> {
    tokens.iter().map(|token| number(token, line)).collect()
}
