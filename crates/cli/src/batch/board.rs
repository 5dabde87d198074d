//! Progress over many pairs, on stderr: bars on a terminal, one line per pair elsewhere.

use crate::output;
use congruent_pipeline::Stage;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The progress display of a task with many parts.
pub(super) struct Board {
    /// `None` if stderr is not a terminal.
    bars: Option<Bars>,
    all: usize,
    ended: AtomicUsize,
}

struct Bars {
    board: MultiProgress,
    all: ProgressBar,
    workers: Vec<ProgressBar>,
}

impl Board {
    /// Makes a display with a line for each worker.
    pub(super) fn new(all: usize, what: &str, workers: usize) -> Board {
        let bars = std::io::stderr().is_terminal().then(|| Bars::new(all, what, workers));
        Board { bars, all, ended: AtomicUsize::new(0) }
    }

    /// Makes a display for a short task: one bar, and nothing if stderr is not a terminal.
    pub(super) fn quiet(all: usize, what: &str) -> Board {
        Board::new(all, what, 0)
    }

    pub(super) fn step(&self) {
        if let Some(bars) = &self.bars {
            bars.all.inc(1);
        }
    }

    pub(super) fn enter(&self, worker: usize, id: &str, stage: Stage) {
        if let Some(bars) = &self.bars {
            bars.workers[worker].set_message(format!("{id}  {stage}"));
        }
    }

    /// Reports that a pair has ended; `word` says how. If `is_bad`, the message stays on the screen.
    pub(super) fn ended(&self, worker: usize, word: &str, is_bad: bool) {
        let ended = self.ended.fetch_add(1, Ordering::Relaxed) + 1;
        match &self.bars {
            Some(bars) => {
                if is_bad {
                    // A terminal that no longer exists is not an error.
                    drop(bars.board.println(word));
                }
                bars.workers[worker].set_message(word.to_owned());
                bars.all.inc(1);
            }
            None => output::remark(&format!("[{ended}/{}] {word}", self.all)),
        }
    }
}

impl Bars {
    fn new(all: usize, what: &str, workers: usize) -> Bars {
        let board = MultiProgress::new();
        let style = |template: &str| ProgressStyle::with_template(template).expect("a valid template");
        let bar = board.add(ProgressBar::new(all as u64));
        bar.set_style(style("{bar:30} {pos}/{len} {msg}  {per_sec}  {eta} left").progress_chars("=> "));
        bar.set_message(what.to_owned());
        let worker = || {
            let bar = board.add(ProgressBar::new_spinner());
            bar.set_style(style("  {wide_msg}"));
            bar
        };
        Bars { workers: (0..workers).map(|_| worker()).collect(), all: bar, board }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.workers.iter().for_each(ProgressBar::finish_and_clear);
        self.all.finish_and_clear();
    }
}
