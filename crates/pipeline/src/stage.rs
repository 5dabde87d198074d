//! The stages of the chain, and how long each took.

use std::fmt;
use std::time::{Duration, Instant};

/// A stage of the chain; the variants are in the order in which they first run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Resolution, strays, voxel grid, and the neighbour index.
    Sampling,
    /// Normals and their orientation.
    Normals,
    /// Keypoint detection.
    Keypoints,
    /// Descriptors, with the local reference frames that they need; in a [`Collection`](crate::Collection) everything
    /// that the supply of the described scans does.
    Description,
    /// Nearest neighbours in descriptor space.
    Matching,
    /// Sampling, scoring and local optimisation of hypotheses; coarse refinement of a guess.
    Estimation,
    /// Choice among the best poses by how well the whole surfaces fit.
    Ranking,
    /// Refinement of chosen poses by iterative closest points.
    Refinement,
    /// Measurements for the verdict.
    Verdict,
}

impl Stage {
    /// All stages, in order.
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

    /// Returns the name of the stage in reports.
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

/// Wall time of one stage, summed over all attempts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTime {
    /// The stage.
    pub stage: Stage,
    /// Its wall time.
    pub time: Duration,
}

/// Tells the observer which stage begins, and sums up the times of the stages.
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
