//! A part of a file, moved along it.

use crate::content::Content;
use std::io::{self, Read, Seek};

/// Bytes that are read at a time: they stay in the cache until they are used.
const BLOCK: usize = 1 << 16;
/// A line or a record that is longer has no end; its file must not decide how much memory is taken.
const LONGEST: usize = 1 << 30;

/// A file's bytes from some place on, as many as were read so far.
///
/// The buffer grows where one record is longer than it, so that any part of a file can be had in one piece.
pub(crate) struct Window {
    content: Content,
    buffer: Vec<u8>,
    /// What of the buffer is read and not used yet.
    start: usize,
    end: usize,
    /// Bytes of the file that were never in the buffer.
    unread: u64,
}

impl Window {
    /// With the file's first bytes: all that tells its format.
    pub(crate) fn new(content: Content) -> Self {
        let mut window = Window::of_blocks(content, BLOCK);
        window.reach(BLOCK);
        window
    }

    /// With no byte yet, reading so many at a time.
    pub(crate) fn of_blocks(content: Content, block: usize) -> Self {
        let unread = content.length();
        Window { content, buffer: vec![0; block], start: 0, end: 0, unread }
    }

    /// What was read and not used yet.
    #[inline]
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// What was used and is still there.
    pub(crate) fn used(&self) -> &[u8] {
        &self.buffer[..self.start]
    }

    /// How many bytes are left, as far as the file's length was true.
    pub(crate) fn left(&self) -> u64 {
        self.unread + (self.end - self.start) as u64
    }

    /// Length of the file.
    pub(crate) fn length(&self) -> u64 {
        self.content.length()
    }

    /// Uses so many of [`Window::bytes`].
    #[inline]
    pub(crate) fn pass(&mut self, n: usize) {
        debug_assert!(n <= self.end - self.start);
        self.start += n;
    }

    /// Lets go what was used.
    pub(crate) fn forget(&mut self) {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
    }

    /// Reads on; whether there was anything. What was used is let go.
    #[cold]
    pub(crate) fn more(&mut self) -> bool {
        self.forget();
        if self.end >= LONGEST {
            self.content.failure().note(io::Error::other("no end of a line or a record within 1 GiB"));
            return false;
        }
        if self.end == self.buffer.len() {
            self.buffer.resize(2 * self.end, 0);
        }
        // Whoever opened the file is told of an error by the content.
        let n = self.content.read(&mut self.buffer[self.end..]).unwrap_or(0);
        self.end += n;
        self.unread = self.unread.saturating_sub(n as u64);
        n > 0
    }

    /// Reads on until there are so many bytes; whether there are.
    #[inline]
    pub(crate) fn reach(&mut self, n: usize) -> bool {
        while self.end - self.start < n {
            if !self.more() {
                return false;
            }
        }
        true
    }

    /// Copies what comes next, past the buffer as far as it is empty; how many bytes there were.
    pub(crate) fn copy_to(&mut self, into: &mut [u8]) -> usize {
        let mut held = (self.end - self.start).min(into.len());
        into[..held].copy_from_slice(&self.bytes()[..held]);
        self.pass(held);
        while held < into.len() {
            // Whoever opened the file is told of an error by the content.
            let n = self.content.read(&mut into[held..]).unwrap_or(0);
            if n == 0 {
                break;
            }
            held += n;
            self.unread = self.unread.saturating_sub(n as u64);
        }
        held
    }

    /// Goes back to the file's beginning, with no byte read yet.
    pub(crate) fn rewind(&mut self) -> io::Result<()> {
        (self.start, self.end, self.unread) = (0, 0, self.content.length());
        self.content.rewind()
    }

    /// The file from its beginning, for readers that go through it by themselves.
    pub(crate) fn rewound(mut self) -> Result<Content, String> {
        self.content.rewind().map_err(|error| error.to_string())?;
        Ok(self.content)
    }
}
