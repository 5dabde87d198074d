//! Progress over many pairs: bars on a terminal, a line a pair elsewhere. All on stderr.

use crate::output;
use congruent_pipeline::Stage;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is shown while pairs run.
pub(super) struct Board {
    /// Nothing where there is no terminal.
    bars: Option<Bars>,
    pairs: usize,
    ended: AtomicUsize,
}

struct Bars {
    all: ProgressBar,
    workers: Vec<ProgressBar>,
}

impl Board {
    pub(super) fn new(pairs: usize, workers: usize) -> Board {
        let bars = std::io::stderr().is_terminal().then(|| Bars::new(pairs, workers));
        Board { bars, pairs, ended: AtomicUsize::new(0) }
    }

    pub(super) fn enter(&self, worker: usize, id: &str, stage: Stage) {
        if let Some(bars) = &self.bars {
            bars.workers[worker].set_message(format!("{id}  {stage}"));
        }
    }

    /// A pair has ended; `word` says how.
    pub(super) fn ended(&self, worker: usize, word: &str) {
        let ended = self.ended.fetch_add(1, Ordering::Relaxed) + 1;
        match &self.bars {
            Some(bars) => {
                bars.workers[worker].set_message(word.to_owned());
                bars.all.inc(1);
            }
            None => output::remark(&format!("[{ended}/{}] {word}", self.pairs)),
        }
    }
}

impl Bars {
    fn new(pairs: usize, workers: usize) -> Bars {
        let board = MultiProgress::new();
        let style = |template: &str| ProgressStyle::with_template(template).expect("a valid template");
        let all = board.add(ProgressBar::new(pairs as u64));
        all.set_style(style("{bar:30} {pos}/{len} pairs  {per_sec}  {eta} left").progress_chars("=> "));
        let worker = || {
            let bar = board.add(ProgressBar::new_spinner());
            bar.set_style(style("  {wide_msg}"));
            bar
        };
        Bars { workers: (0..workers).map(|_| worker()).collect(), all }
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.workers.iter().for_each(ProgressBar::finish_and_clear);
        self.all.finish_and_clear();
    }
}
