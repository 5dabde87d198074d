//! ASCII bodies: a stream of words. Which line a word stands on does not matter.

use super::PlyFault;
use super::body::{Numbers, Stop};
use super::header::Property;
use crate::error::excerpt;
use ply_rs::ply::ScalarType;

/// An ASCII body, together with the header, so that faults can name the line of the file.
pub(super) struct Ascii<'a> {
    file: &'a [u8],
    at: usize,
}

impl<'a> Ascii<'a> {
    pub(super) fn new(file: &'a [u8], body_start: usize) -> Self {
        Ascii { file, at: body_start }
    }

    #[inline]
    fn word(&mut self) -> Result<&'a [u8], Stop> {
        let left = &self.file[self.at..];
        let start = left.iter().position(|b| !b.is_ascii_whitespace()).ok_or(Stop::End)?;
        let word = &left[start..];
        let word = &word[..word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len())];
        self.at += start + word.len();
        Ok(word)
    }

    #[cold]
    fn not_a_number(&self, word: &[u8]) -> Stop {
        let before = &self.file[..self.at - word.len()];
        // A carriage return ends a line unless a line feed follows, which then does.
        let ends = |pair: &[u8]| pair[0] == b'\n' || (pair[0] == b'\r' && pair[1] != b'\n');
        // The pairs leave out the last byte, which ends a line where it is of either kind.
        let last = before.last().is_some_and(|b| matches!(b, b'\n' | b'\r'));
        let line = 1 + before.windows(2).filter(|pair| ends(pair)).count() + usize::from(last);
        PlyFault::NotANumber { line, token: excerpt(word) }.into()
    }
}

impl Numbers for Ascii<'_> {
    fn number(&mut self, _: &ScalarType) -> Result<f64, Stop> {
        let word = self.word()?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.not_a_number(word))
    }

    fn skip(&mut self, _: &ScalarType, n: usize) -> Result<(), Stop> {
        (0..n).try_for_each(|_| self.word().map(drop))
    }

    fn room(&self, properties: &[Property]) -> usize {
        // A word is one character and a space, except for the last one.
        (self.file.len() - self.at).div_ceil(2) / properties.len().max(1)
    }
}
