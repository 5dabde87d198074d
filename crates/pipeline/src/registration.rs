//! The result of a registration.

use crate::ranking::Ranked;
use crate::{Failure, Pair, PipelineConfig, Predictors, Signs, StageTime};
use congruent_geometry::{Oriented, RigidTransform};
use congruent_refinement::{Hold, Uncertainty};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The pose that was found, and whether it is accepted.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The pose is accepted.
    Ok(Estimate),
    /// The pose fits, but so do the others, which are substantially different; best first.
    Ambiguous(Estimate, Vec<Alternative>),
    /// No pose is accepted; the best one found, if there is any, is not to be relied on.
    Failed(Failure, Option<Estimate>),
}

/// A pose that fits nearly as well as the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternative {
    /// Maps source coordinates into the target's frame, both as in the files.
    pub target_from_source: RigidTransform,
    /// The score of the ranking, as in [`Agreement::score`].
    pub score: f64,
}

/// The outcome in one word, as it is printed and stored in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The pose is accepted.
    Ok,
    /// The pose is one of several that fit equally well.
    Ambiguous,
    /// There is no pose, or none that is accepted.
    Failed,
}

impl Verdict {
    /// Returns `ok`, `ambiguous` or `failed`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Ok => "ok",
            Verdict::Ambiguous => "ambiguous",
            Verdict::Failed => "failed",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How many points, keypoints, correspondences and poses there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Points of the scans as provided, without those that [`Scan::new`](congruent_geometry::Scan::new) dropped.
    pub points: Pair<usize>,
    /// Points among these that were left out as strays.
    #[serde(default)]
    pub strays: Pair<usize>,
    /// Points after sampling.
    pub sampled: Pair<usize>,
    /// Keypoints with enough support.
    pub keypoints: Pair<usize>,
    /// Keypoints with a valid descriptor.
    pub described: Pair<usize>,
    /// Correspondences kept.
    pub correspondences: usize,
    /// Trials of the estimator, including those that yielded no pose, and poses from the prior's guess.
    pub trials: u64,
    /// Poses in the pool: the different ones that were kept for the ranking.
    pub poses: usize,
    /// Correspondences that are inliers of the answer.
    pub inliers: usize,
}

/// How well the two surfaces fit each other under the answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// The score by which the answer was chosen: overlap, discounted for every contradiction; 0 to 1.
    pub score: f64,
    /// Fraction of the points with a point of the other surface close by and normals that agree, averaged over both
    /// directions.
    pub overlap: f64,
    /// Mean distance of those points to the other surface's tangent plane, in `pr`; `None` if nothing overlaps.
    pub residual_pr: Option<f64>,
    /// Fraction of the points that float in front of the other surface, summed over both directions.
    pub hover: f64,
    /// Fraction of the points that would have hidden what the other scanner saw, summed over both directions.
    pub occlusion: f64,
    /// Fraction of the points that touch the other surface with normals that disagree, averaged over both directions.
    pub disagreeing: f64,
}

impl Agreement {
    pub(crate) fn new(ranked: &Ranked, resolution: f64) -> Self {
        let measured = &ranked.agreement;
        Agreement {
            score: ranked.score.value(),
            overlap: measured.overlap,
            residual_pr: measured.residual.is_finite().then(|| measured.residual / resolution),
            hover: measured.hover,
            occlusion: measured.occlusion,
            disagreeing: measured.disagreeing,
        }
    }
}

/// How well a pose fits, by the dense ranking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// How well the surfaces fit each other.
    pub agreement: Agreement,
    /// The measurements from which the confidence was computed.
    pub predictors: Predictors,
}

/// The best pose that was found, with what was measured of it.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Maps source coordinates into the target's frame, both as in the files.
    pub target_from_source: RigidTransform,
    /// Probability that the pose is right, 0 to 1. An ambiguous pose shares it equally with its alternatives.
    /// Calibrated for the verdict `dense` (see [`crate::Calibration`]); otherwise one half at the border between the
    /// verdicts.
    pub confidence: f64,
    /// Score by the configured metric.
    pub score: f64,
    /// Decimal logarithm of the expected number of random poses with as many inliers, among all that were tried.
    pub log10_false_alarms: f64,
    /// How firmly the surfaces hold the pose where they touch.
    pub hold: Hold,
    /// The viewpoint of each scan in file coordinates, if a single viewpoint explains it, and whether the side to which
    /// the normals point is reliable.
    pub views: Pair<Oriented>,
    /// How well the surfaces fit each other; `None` without a dense ranking.
    pub fit: Option<Fit>,
    /// How accurate the pose is, in the target's file coordinates; `None` if it was not refined or too little touches
    /// to tell.
    pub uncertainty: Option<Uncertainty>,
}

/// The result for one pair of scans.
#[derive(Clone, Debug)]
pub struct Registration {
    /// The pose, and whether it is accepted.
    pub outcome: Outcome,
    /// Settings of the attempt that gave the answer.
    pub settings: Settings,
    /// Counts of the stages of that attempt.
    pub counts: Counts,
    /// Mean resolution of the scans as provided, without strays that were left out, data units; zero if sampling
    /// failed. In a [`Collection`](crate::Collection), the shared length.
    pub raw_resolution: f64,
    /// Meaning of `pr` in all stages after sampling, data units; zero if sampling failed. In a
    /// [`Collection`](crate::Collection), the shared length.
    pub resolution: f64,
    /// Wall time of each stage that ran, over all attempts; in the order in which stages first ran.
    pub timings: Vec<StageTime>,
}

/// The settings of an attempt.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The configuration, with the changes that the attempt makes to it.
    pub config: PipelineConfig,
    /// Which side the normals point to.
    pub signs: Signs,
}

impl Registration {
    /// Returns whether the pose is accepted.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        match &self.outcome {
            Outcome::Ok(_) => Verdict::Ok,
            Outcome::Ambiguous(..) => Verdict::Ambiguous,
            Outcome::Failed(..) => Verdict::Failed,
        }
    }

    /// Returns the best pose found, whatever the verdict; `None` if there is none.
    #[must_use]
    pub fn estimate(&self) -> Option<&Estimate> {
        match &self.outcome {
            Outcome::Ok(estimate) | Outcome::Ambiguous(estimate, _) => Some(estimate),
            Outcome::Failed(_, estimate) => estimate.as_ref(),
        }
    }

    /// Returns the pose, source to target in the coordinates of the files: the accepted one, or else the best found.
    #[must_use]
    pub fn pose(&self) -> Option<&RigidTransform> {
        self.estimate().map(|estimate| &estimate.target_from_source)
    }

    /// Returns the probability that the pose is right, 0 to 1; zero without a pose.
    #[must_use]
    pub fn confidence(&self) -> f64 {
        self.estimate().map_or(0.0, |estimate| estimate.confidence)
    }

    /// Returns how well the surfaces fit each other; `None` without a pose or a dense ranking.
    #[must_use]
    pub fn fit(&self) -> Option<&Fit> {
        self.estimate().and_then(|estimate| estimate.fit.as_ref())
    }

    /// Returns how accurate the pose is; `None` without a pose, or if that is not known.
    #[must_use]
    pub fn uncertainty(&self) -> Option<&Uncertainty> {
        self.estimate().and_then(|estimate| estimate.uncertainty.as_ref())
    }

    /// Returns the poses that fit nearly as well, best first; empty unless the verdict is ambiguous.
    #[must_use]
    pub fn alternatives(&self) -> &[Alternative] {
        match &self.outcome {
            Outcome::Ambiguous(_, others) => others,
            _ => &[],
        }
    }

    /// Returns why no pose is accepted; `None` unless the verdict is failed.
    #[must_use]
    pub fn failure(&self) -> Option<&Failure> {
        match &self.outcome {
            Outcome::Failed(failure, _) => Some(failure),
            _ => None,
        }
    }

    /// Returns in words why the pose is not accepted; `None` if it is.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        match &self.outcome {
            Outcome::Ok(_) => None,
            Outcome::Ambiguous(_, others) => Some(format!(
                "{} substantially different poses fit nearly as well: the scene is symmetric or repeats itself; an \
                 initial pose or more overlap would tell them apart",
                others.len()
            )),
            Outcome::Failed(failure, _) => Some(failure.to_string()),
        }
    }
}
