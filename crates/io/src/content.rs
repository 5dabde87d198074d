//! A file that is open, read as it is asked for.

use crate::IoError;
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// The bytes of a scan's file, of a known number.
///
/// Readers take an error of the system for a damaged file, so the first one is kept aside, for whoever knows the path to tell.
pub(crate) struct Content {
    bytes: Box<dyn Bytes>,
    length: u64,
    failure: Failure,
}

/// Where bytes come from.
trait Bytes: Read + Seek + Send + Sync {}

impl<T: Read + Seek + Send + Sync> Bytes for T {}

/// What went wrong while a content was read.
#[derive(Clone, Default)]
pub(crate) struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Content {
    /// Opens a file of at least one byte. What cannot be read twice, as a pipe, is taken into memory.
    pub(crate) fn open(path: &Path) -> Result<Content, IoError> {
        // Asked only now: the error a directory gives differs from system to system.
        let failed = |reason| match path.is_dir() {
            true => IoError::Directory { path: path.to_owned() },
            false => IoError::Read { path: path.to_owned(), reason },
        };
        let mut file = File::open(path).map_err(failed)?;
        let content = if file.metadata().is_ok_and(|about| about.is_file()) {
            let length =
                file.seek(SeekFrom::End(0)).and_then(|length| file.rewind().map(|()| length)).map_err(failed)?;
            Content { bytes: Box::new(file), length, failure: Failure::default() }
        } else {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(failed)?;
            Content::of(bytes)
        };
        if content.length == 0 { Err(IoError::Empty { path: path.to_owned() }) } else { Ok(content) }
    }

    /// What is in memory.
    pub(crate) fn of(bytes: Vec<u8>) -> Content {
        Content { length: bytes.len() as u64, bytes: Box::new(Cursor::new(bytes)), failure: Failure::default() }
    }

    /// How many bytes there are.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    pub(crate) fn failure(&self) -> Failure {
        self.failure.clone()
    }
}

impl Failure {
    /// The first error, once.
    pub(crate) fn take(&self) -> Option<io::Error> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take()
    }

    /// Keeps an error, and gives one like it.
    pub(crate) fn note(&self, error: io::Error) -> io::Error {
        let like = error.kind().into();
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).get_or_insert(error);
        like
    }
}

impl Read for Content {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.bytes.read(into) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => return read.map_err(|error| self.failure.note(error)),
            }
        }
    }
}

impl Seek for Content {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        // A place before the beginning is the file's mistake, not the system's.
        self.bytes.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk that fails behind the first bytes.
    struct Failing(usize);

    impl Read for Failing {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let n = into.len().min(self.0);
            if n == 0 {
                return Err(io::Error::other("the cable is out"));
            }
            into[..n].fill(b' ');
            into[..n.min(4)].copy_from_slice(&b"ply\n"[..n.min(4)]);
            self.0 -= n;
            Ok(n)
        }
    }

    impl Seek for Failing {
        fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
            Ok(0)
        }
    }

    #[test]
    fn a_failing_disk_is_told_and_not_taken_for_a_damaged_file() {
        let content = Content { bytes: Box::new(Failing(100)), length: 1000, failure: Failure::default() };
        let message =
            crate::read::scan_in(Path::new("far.ply"), content, crate::gathered::Keep::All).unwrap_err().to_string();
        assert_eq!(message, "far.ply: cannot be read (the cable is out); check the path and its permissions");
    }
}
