//! Progress for the eye: one line on stderr, and nothing where stderr is no terminal.

use congruent_pipeline::Stage;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A bar over the stages of the chain.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    pub(crate) fn new() -> Self {
        let target =
            if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(Stage::ALL.len() as u64), target);
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

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
