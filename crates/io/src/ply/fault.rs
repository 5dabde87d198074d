//! What can be wrong with a PLY file.

/// Why a PLY file could not be read. Lines, records and faces count from one, vertex indices from zero.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlyFault {
    /// A header line breaks the grammar.
    #[error("header line {line}, `{text}`: {expected}; correct it or export the file again")]
    Header {
        /// Where.
        line: usize,
        /// The line, shortened.
        text: String,
        /// What should stand there.
        expected: &'static str,
    },
    /// An encoding or a version that does not exist.
    #[error(
        "header line {line}, `{text}`: this encoding or version is not supported; \
         save the file as ascii 1.0, binary_little_endian 1.0 or binary_big_endian 1.0"
    )]
    Encoding {
        /// Where.
        line: usize,
        /// The line, shortened.
        text: String,
    },
    /// The file ends within the header.
    #[error("the header has no `end_header` line; the file is cut short or not a PLY file, copy or export it again")]
    NoHeaderEnd,
    /// No element is called `vertex`.
    #[error("no element is called `vertex` (found: {found}); export the file with its points")]
    NoVertices {
        /// The elements there are.
        found: String,
    },
    /// `x`, `y` or `z` is missing or a list.
    #[error("the vertices have no number `{missing}` (found: {found}); export the file with x, y and z")]
    NoCoordinate {
        /// The first one missing.
        missing: &'static str,
        /// The properties there are.
        found: String,
    },
    /// The file ends before the last record that the header promises.
    #[error(
        "the header promises {promised} `{element}` records, the file ends in record {} after {held} whole ones; \
         it is cut short, copy or export it again", held + 1
    )]
    Truncated {
        /// The element.
        element: String,
        /// How many records the header promises.
        promised: usize,
        /// How many whole records the file holds.
        held: usize,
    },
    /// A word in an ASCII body is no number.
    #[error("line {line}: `{token}` is not a number; correct it or export the file again")]
    NotANumber {
        /// Line of the file.
        line: usize,
        /// The word, shortened.
        token: String,
    },
    /// A list's length is negative or not whole.
    #[error("`{element}` record {record} has a list of length {length}; the file is damaged, copy or export it again")]
    ListLength {
        /// The element.
        element: String,
        /// The record.
        record: usize,
        /// Its length.
        length: f64,
    },
    /// A face has a corner that does not exist.
    #[error(
        "face {face} has vertex index {index}, valid: 0 to {n_vertices} exclusive; repair or export the file again"
    )]
    FaceIndex {
        /// The face.
        face: usize,
        /// What it points to.
        index: f64,
        /// How many vertices there are.
        n_vertices: usize,
    },
}
