//! The only places that print.

use anyhow::{Context, Result};
use std::io::{ErrorKind, Write};

/// Data, for stdout. A reader that has closed the pipe is no error.
pub(crate) fn data(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("standard output: cannot be written"),
        _ => Ok(()),
    }
}

/// A remark for people, on stderr. Where that is closed, nobody reads it, and the work goes on.
pub(crate) fn remark(text: &str) {
    drop(writeln!(std::io::stderr().lock(), "{text}"));
}

/// What went wrong, on stderr.
pub(crate) fn complain(text: &str) {
    remark(&format!("error: {text}"));
}
