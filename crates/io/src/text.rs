//! Lines and words of the text formats.

use crate::error::excerpt;
use crate::window::Window;
use std::io;

/// What some editors begin a text with.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Lines counted from one, without white space around them. Ends are those of any system; a byte order mark is left out.
pub(crate) fn lines(file: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let file = file.strip_prefix(BYTE_ORDER_MARK).unwrap_or(file);
    let end = end_of_lines(file);
    (1..).zip(file.split(move |&b| b == end)).map(|(number, line)| (number, line.trim_ascii()))
}

fn end_of_lines(file: &[u8]) -> u8 {
    if file.contains(&b'\n') { b'\n' } else { b'\r' }
}

/// The same lines of a file that is read on the way; the first part of it says how lines end.
pub(crate) struct Lines {
    file: Window,
    end: u8,
    /// Length of what stands before the first line.
    mark: usize,
    /// Length of the line that was handed over last.
    used: usize,
    number: usize,
}

impl Lines {
    pub(crate) fn of(mut file: Window) -> Self {
        file.reach(BYTE_ORDER_MARK.len());
        let mark = if file.bytes().starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        Lines { end: end_of_lines(file.bytes()), file, mark, used: mark, number: 0 }
    }

    /// Goes back to the first line.
    pub(crate) fn rewind(&mut self) -> io::Result<()> {
        self.file.rewind()?;
        self.file.reach(self.mark);
        (self.used, self.number) = (self.mark, 0);
        Ok(())
    }

    /// The next line and its number.
    pub(crate) fn next(&mut self) -> Option<(usize, &[u8])> {
        let length = self.advance()?;
        Some((self.number, self.file.bytes()[..length].trim_ascii()))
    }

    /// The next line that has something before a `#`: its number, and that part.
    pub(crate) fn next_uncommented(&mut self) -> Option<(usize, &[u8])> {
        loop {
            let length = self.advance()?;
            if !uncommented(&self.file.bytes()[..length]).is_empty() {
                return Some((self.number, uncommented(&self.file.bytes()[..length])));
            }
        }
    }

    /// Moves to the next line and says how long it is without its end.
    fn advance(&mut self) -> Option<usize> {
        self.file.pass(self.used);
        let mut searched = 0;
        let length = loop {
            let bytes = self.file.bytes();
            match bytes[searched..].iter().position(|b| *b == self.end) {
                Some(length) => break searched + length,
                None => searched = bytes.len(),
            }
            if !self.file.more() {
                break searched;
            }
        };
        // Behind the last line there is nothing, not even its end.
        self.used = (length + 1).min(self.file.bytes().len());
        self.number += 1;
        (self.used > 0).then_some(length)
    }
}

/// The part before a `#`, without white space around it.
pub(crate) fn uncommented(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii()
}

/// Words parted by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The number a word is; `nan` and `inf` are numbers.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// The number a word is, or what is wrong with it.
pub(crate) fn number_at(word: &[u8], line: usize) -> Result<f64, String> {
    number(word)
        .ok_or_else(|| format!("line {line}: `{}` is not a number; correct it or export the file again", excerpt(word)))
}

/// The next three words as numbers.
pub(crate) fn three<'a>(words: &mut impl Iterator<Item = &'a [u8]>, line: usize) -> Result<[f64; 3], String> {
    let mut found = [0.0; 3];
    for (at, value) in found.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            format!("line {line}: expected 3 numbers, found {at}; correct it or export the file again")
        })?;
        *value = number_at(word, line)?;
    }
    Ok(found)
}

/// Cuts a polygon into triangles around its first corner.
pub(crate) fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let rest = corners.get(1..).unwrap_or_default();
    rest.windows(2).map(|pair| [corners[0], pair[0], pair[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::content::Content;

    #[test]
    fn lines_are_the_same_however_a_file_is_read() {
        for text in ["", "a", "a\n", "\n\na b\r\nlonger than any block\n\n c ", "\u{feff}a\nb", "a\rb"] {
            let expected: Vec<_> = lines(text.as_bytes()).filter(|(_, line)| !line.is_empty()).collect();
            for block in [5, 6, 100] {
                let mut lines = Lines::of(Window::of_blocks(Content::of(text.into()), block));
                for _ in 0..2 {
                    let mut found = Vec::new();
                    while let Some((number, line)) = lines.next() {
                        found.extend((!line.is_empty()).then(|| (number, line.to_vec())));
                    }
                    let found: Vec<_> = found.iter().map(|(number, line)| (*number, line.as_slice())).collect();
                    assert_eq!(found, expected, "{text:?}, {block} bytes at a time");
                    lines.rewind().unwrap();
                }
            }
        }
    }

    #[test]
    fn comments_and_blank_lines_are_passed_over() {
        let mut lines = Lines::of(Window::new(Content::of("# a\n\n b # c\n  #\nd".into())));
        assert_eq!(lines.next_uncommented(), Some((3, b"b".as_slice())));
        assert_eq!(lines.next_uncommented(), Some((5, b"d".as_slice())));
        assert_eq!(lines.next_uncommented(), None);
    }
}
