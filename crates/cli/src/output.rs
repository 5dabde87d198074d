//! The only functions that print.

use anyhow::{Context, Result};
use std::io::{ErrorKind, Write};

/// Prints data to stdout. A reader that has closed the pipe is not an error.
pub(crate) fn data(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("standard output: cannot be written"),
        _ => Ok(()),
    }
}

/// Prints a remark for people to stderr. If stderr is closed, the remark is lost and the work continues.
pub(crate) fn remark(text: &str) {
    drop(writeln!(std::io::stderr().lock(), "{text}"));
}

/// Prints an error message to stderr.
pub(crate) fn complain(text: &str) {
    remark(&format!("error: {text}"));
}
