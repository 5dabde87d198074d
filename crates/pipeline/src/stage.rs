//! The stages of the chain, and how long each took.

use std::fmt;
use std::time::{Duration, Instant};

/// A stage of the chain, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Resolution and voxel grid.
    Sampling,
    /// Normals, their orientation, and the neighbour index.
    Normals,
    /// Keypoint detection.
    Keypoints,
    /// Local reference frames and descriptors.
    Description,
    /// Nearest neighbours in descriptor space.
    Matching,
    /// Sampling and scoring of hypotheses.
    Estimation,
    /// Choice among the best poses by the whole surfaces.
    Ranking,
    /// Iterative closest points.
    Refinement,
    /// The word on whether it worked.
    Verdict,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Stage; 9] = [
        Stage::Sampling,
        Stage::Normals,
        Stage::Keypoints,
        Stage::Description,
        Stage::Matching,
        Stage::Estimation,
        Stage::Ranking,
        Stage::Refinement,
        Stage::Verdict,
    ];

    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Stage::Sampling => "sampling",
            Stage::Normals => "normals",
            Stage::Keypoints => "keypoints",
            Stage::Description => "description",
            Stage::Matching => "matching",
            Stage::Estimation => "estimation",
            Stage::Ranking => "ranking",
            Stage::Refinement => "refinement",
            Stage::Verdict => "verdict",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Wall time of one stage, over all attempts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTime {
    /// Which.
    pub stage: Stage,
    /// How long.
    pub time: Duration,
}

/// Tells the observer what begins and keeps the time of what ended.
pub(crate) struct Clock<'a> {
    observe: &'a dyn Fn(Stage),
    pub(crate) times: Vec<StageTime>,
}

impl<'a> Clock<'a> {
    pub(crate) fn new(observe: &'a dyn Fn(Stage)) -> Self {
        Clock { observe, times: Vec::with_capacity(Stage::ALL.len()) }
    }

    pub(crate) fn time<T>(&mut self, stage: Stage, work: impl FnOnce() -> T) -> T {
        (self.observe)(stage);
        let start = Instant::now();
        let result = work();
        let time = start.elapsed();
        match self.times.iter_mut().find(|t| t.stage == stage) {
            Some(earlier) => earlier.time += time,
            None => self.times.push(StageTime { stage, time }),
        }
        result
    }
}
