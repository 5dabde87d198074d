//! A file of which some bytes read as zero: what a library's reader would stumble over is hidden from it.

use crate::content::Content;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

/// The rest of the file is as it is.
pub(crate) struct Blanked {
    file: Content,
    at: u64,
    zeros: Range<u64>,
}

impl Blanked {
    /// Of a file that stands at its beginning.
    pub(crate) fn new(file: Content, zeros: Range<u64>) -> Self {
        Blanked { file, at: 0, zeros }
    }

    /// Length of the file.
    pub(crate) fn length(&self) -> u64 {
        self.file.length()
    }
}

impl Read for Blanked {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(into)?;
        for (at, byte) in (self.at..).zip(&mut into[..n]).take_while(|(at, _)| *at < self.zeros.end) {
            if self.zeros.contains(&at) {
                *byte = 0;
            }
        }
        self.at += n as u64;
        Ok(n)
    }
}

impl Seek for Blanked {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_bytes_in_the_range_are_zero_wherever_reading_begins() {
        let mut file = Blanked::new(Content::of(b"abcdefgh".to_vec()), 2..5);
        let mut all = Vec::new();
        file.read_to_end(&mut all).unwrap();
        assert_eq!(all, b"ab\0\0\0fgh");
        file.seek(SeekFrom::Start(4)).unwrap();
        let mut rest = [0; 3];
        file.read_exact(&mut rest).unwrap();
        assert_eq!(&rest, b"\0fg");
    }
}
