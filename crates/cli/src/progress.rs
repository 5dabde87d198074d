//! Progress display: one line on stderr, and nothing if stderr is not a terminal.

use congruent_pipeline::Stage;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A progress bar over the stages of the pipeline.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    pub(crate) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(Some(Stage::ALL.len() as u64), target());
        let style = ProgressStyle::with_template("{bar:21} {pos}/{len} {msg}").expect("a valid template");
        bar.set_style(style.progress_chars("=> "));
        Progress(bar)
    }

    pub(crate) fn enter(&self, stage: Stage) {
        let done = Stage::ALL.iter().position(|s| *s == stage).unwrap_or_default();
        self.0.set_position(done as u64);
        self.0.set_message(stage.name());
    }
}

/// Returns stderr if it is a terminal, otherwise a hidden target.
fn target() -> ProgressDrawTarget {
    if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
}

/// A progress bar over many pairs.
pub(crate) struct Bar(ProgressBar);

impl Bar {
    pub(crate) fn new(length: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(length), target());
        let style =
            ProgressStyle::with_template("{bar:30} {pos}/{len} {msg} (about {eta} left)").expect("a valid template");
        bar.set_style(style.progress_chars("=> "));
        Bar(bar)
    }

    pub(crate) fn at(&self, done: u64, message: &str) {
        self.0.set_position(done);
        self.0.set_message(message.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
