//! Why a file could not be read or written.

use crate::{DatasetFault, NpyFault, PlyFault, PoseFault, TableFault};
use std::io;
use std::path::PathBuf;

/// A file that could not be read or written. Every message starts with the path and ends with a way out.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The operating system refused to read: no such file, no permission, a failing disk.
    #[error("{}: cannot be read ({reason}); check the path and its permissions", path.display())]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// The operating system's answer.
        reason: io::Error,
    },
    /// The path leads to a directory.
    #[error("{}: is a directory; give the path of a file in it", path.display())]
    Directory {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file has no bytes.
    #[error("{}: is empty; copy or export it again", path.display())]
    Empty {
        /// The file asked for.
        path: PathBuf,
    },
    /// No supported format begins like this file.
    #[error(
        "{}: the content is not in a supported format (extension: {extension}); convert it to {supported}",
        path.display()
    )]
    UnknownFormat {
        /// The file asked for.
        path: PathBuf,
        /// What follows the last point of its name, or `none`.
        extension: String,
        /// Names of the formats that can be read.
        supported: String,
    },
    /// A PLY file that breaks the format.
    #[error("{}: {fault}", path.display())]
    Ply {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong, and where.
        fault: PlyFault,
    },
    /// A file of another format that breaks it.
    #[error("{} ({format}): {what}", path.display())]
    Malformed {
        /// The file asked for.
        path: PathBuf,
        /// Name of the format.
        format: &'static str,
        /// What is wrong, where, and the way out.
        what: String,
    },
    /// The name of a file to be written ends in no supported format.
    #[error("{}: the extension ({extension}) is not supported for writing; use one of {supported}", path.display())]
    UnknownExtension {
        /// The file that was to be written.
        path: PathBuf,
        /// What follows the last point of its name, or `none`.
        extension: String,
        /// Extensions that can be written.
        supported: String,
    },
    /// A format that can hold nothing of the scan.
    #[error("{}: cannot be {format}: {what}", path.display())]
    CannotHold {
        /// The file that was to be written.
        path: PathBuf,
        /// Name of the format.
        format: &'static str,
        /// What is missing, and the way out.
        what: String,
    },
    /// A pose file that holds no rigid motion.
    #[error("{}: {fault}", path.display())]
    Pose {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong, and where.
        fault: PoseFault,
    },
    /// The description or the ground truth of a data set that cannot be used.
    #[error("{}: {fault}", path.display())]
    Dataset {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong, and where.
        fault: DatasetFault,
    },
    /// A table that is not the one asked for.
    #[error("{}: {fault}", path.display())]
    Table {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong, and where.
        fault: TableFault,
    },
    /// A matrix that cannot be used.
    #[error("{}: {fault}", path.display())]
    Npy {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong, and where.
        fault: NpyFault,
    },
    /// The operating system refused to write. No part of the file was put in place.
    #[error(
        "{}: cannot be written ({reason}); check that its folder exists, has room and may be written to",
        path.display()
    )]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// The operating system's answer.
        reason: io::Error,
    },
}

/// Up to sixty characters of a file, fit for one line of a message.
pub(crate) fn excerpt(bytes: &[u8]) -> String {
    const LONGEST: usize = 60;
    // Four bytes a character at most, so the cut leaves enough of them; a broken last one becomes a question mark.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * LONGEST)]);
    let head = head.trim();
    let mut text: String = head.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if head.chars().count() > LONGEST {
        text.push('…');
    }
    text
}
