//! ASCII bodies: a stream of words. Which line a word stands on does not matter.

use super::PlyFault;
use super::body::{Numbers, Stop};
use super::header::Property;
use crate::error::excerpt;
use crate::gathered::Precision;
use crate::window::Window;
use ply_rs::ply::ScalarType;
use std::ops::Range;

/// An ASCII body. It counts lines, so that faults can name the line of the file.
pub(super) struct Ascii<'a> {
    body: &'a mut Window,
    /// Ends of lines before what the window holds.
    ends_before: usize,
}

impl<'a> Ascii<'a> {
    /// What follows a header of so many lines.
    pub(super) fn new(body: &'a mut Window, n_lines: usize) -> Self {
        body.forget();
        Ascii { body, ends_before: n_lines }
    }

    /// Where in the window the next word is.
    #[inline]
    fn reach_word(&mut self) -> Result<Range<usize>, Stop> {
        loop {
            let bytes = self.body.bytes();
            let start = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(bytes.len());
            if let Some(length) = bytes[start..].iter().position(u8::is_ascii_whitespace) {
                return Ok(start..start + length);
            }
            let rest = 0..bytes.len() - start;
            self.body.pass(start);
            if !self.more() {
                return if rest.is_empty() { Err(Stop::End) } else { Ok(rest) };
            }
        }
    }

    /// Reads on, with the lines counted that are let go.
    #[cold]
    fn more(&mut self) -> bool {
        let passed = self.ends_passed();
        let before = self.body.used().last().copied();
        self.ends_before += passed;
        let is_more = self.body.more();
        // What was taken for a lone return is the first half of an end.
        if before == Some(b'\r') && self.body.bytes().first() == Some(&b'\n') {
            self.ends_before -= 1;
        }
        is_more
    }

    /// Ends of lines that the window holds and that are passed.
    fn ends_passed(&self) -> usize {
        let (used, next) = (self.body.used(), self.body.bytes().first());
        // A carriage return ends a line unless a line feed follows, which then does.
        let ends = |pair: &[u8]| pair[0] == b'\n' || (pair[0] == b'\r' && pair[1] != b'\n');
        let last = used.last().is_some_and(|last| ends(&[*last, next.copied().unwrap_or_default()]));
        used.windows(2).filter(|pair| ends(pair)).count() + usize::from(last)
    }

    /// The word is the next one.
    #[cold]
    fn not_a_number(&mut self, word: &Range<usize>) -> Stop {
        self.body.pass(word.start);
        let line = 1 + self.ends_before + self.ends_passed();
        PlyFault::NotANumber { line, token: excerpt(&self.body.bytes()[..word.len()]) }.into()
    }
}

impl Numbers for Ascii<'_> {
    fn number(&mut self, _: &ScalarType) -> Result<f64, Stop> {
        let word = self.reach_word()?;
        let number = str::from_utf8(&self.body.bytes()[word.clone()]).ok().and_then(|word| word.parse().ok());
        let Some(number) = number else { return Err(self.not_a_number(&word)) };
        self.body.pass(word.end);
        Ok(number)
    }

    fn skip(&mut self, _: &ScalarType, n: usize) -> Result<(), Stop> {
        (0..n).try_for_each(|_| self.reach_word().map(|word| self.body.pass(word.end)))
    }

    /// A text may have more digits than the type of its numbers.
    fn precision(&self, _: &ScalarType) -> Precision {
        Precision::Double
    }

    fn room(&self, properties: &[Property]) -> usize {
        // A word is one character and a space, except for the last one.
        let left = usize::try_from(self.body.left()).unwrap_or(usize::MAX);
        left.div_ceil(2) / properties.len().max(1)
    }
}
