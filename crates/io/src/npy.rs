//! Matrices of `f32` in NumPy's `.npy` format: version 1.0, little-endian, row after row.
//!
//! Written by hand because the crates that read every variant of the format bring a parser generator or an array
//! library with them; the one variant used here is a short header and the bare numbers.

use crate::error::excerpt;
use crate::read::bytes_of;
use crate::{IoError, write_file};
use std::path::Path;

const MAGIC: &[u8] = b"\x93NUMPY";
/// Magic, version and the length of the header.
const PREFIX: usize = 10;
/// The numbers begin at a multiple of this: the format asks for it, so that files can be mapped into memory.
const ALIGNMENT: usize = 64;

/// Rows of equally many numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix {
    /// How many rows there are.
    pub rows: usize,
    /// Numbers in a row, at least one.
    pub columns: usize,
    /// The rows, one after the other.
    pub values: Vec<f32>,
}

/// Why a file is no matrix that can be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NpyFault {
    /// The first bytes are others.
    #[error("does not begin as a .npy file; write one with numpy.save or `congruent describe`")]
    Magic,
    /// A later version of the format.
    #[error("is of .npy version {major}.{minor}; only 1.0 is read, which numpy.save writes for plain matrices")]
    Version {
        /// First number.
        major: u8,
        /// Second number.
        minor: u8,
    },
    /// The header says something else, or cannot be read.
    #[error("the header says {key} `{found}`, expected {expected}; save numpy.ascontiguousarray(matrix, dtype='<f4')")]
    Header {
        /// The entry.
        key: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The file is shorter or longer than its header says.
    #[error(
        "the header promises {rows} x {columns} numbers of 4 bytes, but {found} bytes follow it; copy or save the file again"
    )]
    Size {
        /// Rows promised.
        rows: usize,
        /// Columns promised.
        columns: usize,
        /// Bytes after the header.
        found: usize,
    },
    /// A descriptor cannot be compared.
    #[error("row {row}, column {column} (counted from 0) is {value}; remove rows with numbers that are not finite")]
    NotFinite {
        /// Counted from zero.
        row: usize,
        /// Counted from zero.
        column: usize,
        /// NaN or infinite.
        value: f32,
    },
}

/// Writes a matrix. See [`write_file`] for how the file is replaced.
///
/// # Errors
/// The file cannot be written.
///
/// # Panics
/// When the values are not as many as rows times columns.
pub fn write_npy(path: &Path, matrix: &Matrix) -> Result<(), IoError> {
    write_file(path, &bytes(matrix))
}

/// Reads a matrix of finite `f32`.
///
/// # Errors
/// The file cannot be read, holds anything but a two-dimensional matrix of little-endian `f32` in row order, or a
/// number that is not finite.
///
/// # Examples
/// ```
/// use congruent_io::{Matrix, read_npy, write_npy};
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("features.npy");
/// let matrix = Matrix { rows: 2, columns: 3, values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
/// write_npy(&path, &matrix)?;
/// assert_eq!(read_npy(&path)?, matrix);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_npy(path: &Path) -> Result<Matrix, IoError> {
    parse(&bytes_of(path)?).map_err(|fault| IoError::Npy { path: path.to_owned(), fault })
}

fn bytes(matrix: &Matrix) -> Vec<u8> {
    let Matrix { rows, columns, values } = matrix;
    assert_eq!(values.len(), rows * columns, "one value for each row and column");
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let end = (PREFIX + header.len() + 1).next_multiple_of(ALIGNMENT);
    let padding = end - PREFIX - header.len() - 1;
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    let length = u16::try_from(header.len()).expect("two numbers make no header of 64 KiB");
    let mut bytes = Vec::with_capacity(end + 4 * values.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&[1, 0]);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

fn parse(bytes: &[u8]) -> Result<Matrix, NpyFault> {
    let version = bytes.strip_prefix(MAGIC).ok_or(NpyFault::Magic)?;
    let [major, minor, low, high, rest @ ..] = version else { return Err(NpyFault::Magic) };
    if (*major, *minor) != (1, 0) {
        return Err(NpyFault::Version { major: *major, minor: *minor });
    }
    let length = usize::from(u16::from_le_bytes([*low, *high]));
    let (header, data) = rest.split_at_checked(length).ok_or(NpyFault::Magic)?;
    let header = String::from_utf8_lossy(header);
    entry(&header, "descr", "<f4", |text| text == "<f4")?;
    entry(&header, "fortran_order", "False", |text| text == "False")?;
    let shape = entry(&header, "shape", "two numbers, (rows, columns), with at least one column", |text| {
        shape(text).is_some_and(|[_, columns]| columns > 0)
    })?;
    let [rows, columns] = shape_of(shape);
    let promised = rows.checked_mul(columns).and_then(|n| n.checked_mul(4));
    if promised != Some(data.len()) {
        return Err(NpyFault::Size { rows, columns, found: data.len() });
    }
    let values: Vec<f32> = data.as_chunks::<4>().0.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect();
    match values.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(NpyFault::NotFinite { row: at / columns, column: at % columns, value: values[at] }),
        None => Ok(Matrix { rows, columns, values }),
    }
}

/// The text of an entry of the header, where it is as expected.
fn entry<'a>(
    header: &'a str,
    key: &'static str,
    expected: &'static str,
    accepted: impl Fn(&str) -> bool,
) -> Result<&'a str, NpyFault> {
    let found = value_of(header, key).unwrap_or("nothing");
    if accepted(found) { Ok(found) } else { Err(NpyFault::Header { key, found: excerpt(found.as_bytes()), expected }) }
}

/// What stands behind `'key':`, up to the next comma outside parentheses, without quotes.
fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, after) = header.split_once(&format!("'{key}'")).or_else(|| header.split_once(&format!("\"{key}\"")))?;
    let after = after.trim_start().strip_prefix(':')?.trim_start();
    let end = match after.strip_prefix('(') {
        Some(_) => after.find(')')? + 1,
        None => after.find([',', '}'])?,
    };
    Some(after[..end].trim().trim_matches(['\'', '"']))
}

fn shape(text: &str) -> Option<[usize; 2]> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut numbers = inner.split(',').map(str::trim).filter(|word| !word.is_empty()).map(str::parse);
    match (numbers.next(), numbers.next(), numbers.next()) {
        (Some(Ok(rows)), Some(Ok(columns)), None) => Some([rows, columns]),
        _ => None,
    }
}

fn shape_of(accepted: &str) -> [usize; 2] {
    shape(accepted).expect("the entry was accepted because it is a shape")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix() -> Matrix {
        Matrix { rows: 2, columns: 3, values: vec![1.5, -0.0, 1e-30, 3.0e38, 5.0, 6.25] }
    }

    /// A file with this header and data.
    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn matrices_survive_the_round_trip() {
        for matrix in [matrix(), Matrix { rows: 0, columns: 33, values: vec![] }] {
            let bytes = bytes(&matrix);
            assert_eq!((bytes.len() - 4 * matrix.values.len()) % ALIGNMENT, 0);
            assert_eq!(parse(&bytes).unwrap(), matrix);
        }
    }

    #[test]
    fn headers_may_be_written_in_other_ways() {
        for header in [
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }\n",
            "{\"shape\":(1,2),\"fortran_order\":False,\"descr\":\"<f4\"}",
        ] {
            assert_eq!(parse(&file(header, &[0; 8])).unwrap().values, [0.0, 0.0], "{header}");
        }
    }

    #[test]
    fn other_files_are_refused_with_the_reason() {
        let good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }";
        let nan = [0.0f32.to_le_bytes(), f32::NAN.to_le_bytes()].concat();
        let mut later = file(good, &[0; 8]);
        later[6] = 2;
        for (bytes, expected) in [
            (b"x,y\n".to_vec(), "does not begin"),
            (MAGIC.to_vec(), "does not begin"),
            (file(good, &[])[..30].to_vec(), "does not begin"),
            (later, "version 2.0"),
            (file(&good.replace("<f4", "<f8"), &[0; 16]), "descr `<f8`, expected <f4"),
            (file(&good.replace("<f4", ">f4"), &[0; 8]), "descr `>f4`"),
            (file(&good.replace("False", "True"), &[0; 8]), "fortran_order `True`"),
            (file(&good.replace("(1, 2)", "(2,)"), &[0; 8]), "shape `(2,)`"),
            (file(&good.replace("(1, 2)", "(1, 2, 1)"), &[0; 8]), "shape `(1, 2, 1)`"),
            (file(&good.replace("(1, 2)", "(9, 0)"), &[]), "shape `(9, 0)`"),
            (file(&good.replace("(1, 2)", "(1, -2)"), &[0; 8]), "shape `(1, -2)`"),
            (file("{'shape': (1", &[]), "descr `nothing`"),
            (file(good, &[0; 7]), "1 x 2 numbers of 4 bytes, but 7 bytes"),
            (file(&good.replace("(1, 2)", "(9999999999999, 9999999999999)"), &[0; 8]), "but 8 bytes"),
            (file(good, &nan), "row 0, column 1 (counted from 0) is NaN"),
        ] {
            let message = parse(&bytes).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn no_damaged_byte_makes_the_reader_panic() {
        let whole = bytes(&matrix());
        for at in 0..whole.len() {
            for value in [0, b'(', b')', b',', b'9', 0xff] {
                let mut damaged = whole.clone();
                damaged[at] = value;
                let _ = parse(&damaged);
            }
            let _ = parse(&whole[..at]);
        }
    }
}
