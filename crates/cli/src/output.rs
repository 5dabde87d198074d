//! The only places that print.

use std::io::Write;

/// Data, for stdout. A reader that has closed the pipe is no error.
pub(crate) fn data(text: &str) {
    let mut out = std::io::stdout().lock();
    drop(writeln!(out, "{text}"));
}

/// A remark for people, on stderr. Where that is closed, nobody reads it, and the work goes on.
pub(crate) fn remark(text: &str) {
    drop(writeln!(std::io::stderr().lock(), "{text}"));
}

/// What went wrong, on stderr.
pub(crate) fn complain(text: &str) {
    remark(&format!("error: {text}"));
}
