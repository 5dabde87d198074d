//! The only places that print.
#![expect(clippy::print_stderr, reason = "this module is what they are kept for")]

use std::io::Write;

/// Data, for stdout. A reader that has closed the pipe is no error.
pub(crate) fn data(text: &str) {
    let mut out = std::io::stdout().lock();
    drop(writeln!(out, "{text}"));
}

/// A remark for people, on stderr.
pub(crate) fn remark(text: &str) {
    eprintln!("{text}");
}

/// What went wrong, on stderr.
pub(crate) fn complain(text: &str) {
    eprintln!("error: {text}");
}
