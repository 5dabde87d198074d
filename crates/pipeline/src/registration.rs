//! The answer.

use crate::ranking::Ranked;
use crate::{Failure, Pair, PipelineConfig, Predictors, Signs, StageTime};
use congruent_geometry::{Oriented, RigidTransform};
use congruent_refinement::{Hold, Uncertainty};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Whether the pose is to be believed.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It is.
    Ok,
    /// It fits, but so do the really different poses that are listed as alternatives.
    Ambiguous,
    /// No pose, or none to be believed.
    Failed(Failure),
}

impl Verdict {
    /// Without the reason.
    #[must_use]
    pub fn kind(&self) -> VerdictKind {
        match self {
            Verdict::Ok => VerdictKind::Ok,
            Verdict::Ambiguous => VerdictKind::Ambiguous,
            Verdict::Failed(_) => VerdictKind::Failed,
        }
    }
}

/// A verdict in a word, as it is printed and kept in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictKind {
    /// To be believed.
    Ok,
    /// One of several poses that fit as well.
    Ambiguous,
    /// Not to be believed.
    Failed,
}

impl VerdictKind {
    /// `ok`, `ambiguous` or `failed`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            VerdictKind::Ok => "ok",
            VerdictKind::Ambiguous => "ambiguous",
            VerdictKind::Failed => "failed",
        }
    }
}

impl fmt::Display for VerdictKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How much of what there was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Points of the scans as they came, without the dropped ones.
    pub points: Pair<usize>,
    /// Those of them that were left out as strays.
    pub strays: Pair<usize>,
    /// Points after sampling.
    pub sampled: Pair<usize>,
    /// Keypoints with enough support.
    pub keypoints: Pair<usize>,
    /// Keypoints with a valid descriptor.
    pub described: Pair<usize>,
    /// Correspondences kept.
    pub correspondences: usize,
    /// Poses that were proposed.
    pub trials: u64,
    /// Different poses that were looked at closely.
    pub poses: usize,
    /// Correspondences that are inliers of the answer.
    pub inliers: usize,
}

/// How the two surfaces lie on each other under the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// What the answer was chosen by: overlap, discounted for what contradicts it; 0 to 1.
    pub score: f64,
    /// Share of points with a point of the other surface close by and normals that agree, both ways averaged.
    pub overlap: f64,
    /// Mean distance of those to the other surface's tangent plane, in `pr`; nothing where nothing overlaps.
    pub residual_pr: Option<f64>,
    /// Share of points that float before the other surface, both ways added.
    pub hover: f64,
    /// Share of points that would have hidden what the other scanner saw, both ways added.
    pub occlusion: f64,
    /// Share of points that touch the other surface with normals that disagree, both ways averaged.
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

/// The answer for one pair of scans.
#[derive(Clone, Debug)]
pub struct Registration {
    /// Those of the attempt that gave the answer.
    pub settings: Settings,
    /// Maps source coordinates into the target's frame, both as in the files. The best guess where the verdict is
    /// `Failed`, if there is any.
    pub target_from_source: Option<RigidTransform>,
    /// Whether to believe it.
    pub verdict: Verdict,
    /// Really different poses that are nearly as good, best first: source to target, file coordinates, with the score of
    /// the ranking. Empty unless the verdict is `Ambiguous`.
    pub alternatives: Vec<(RigidTransform, f64)>,
    /// 0 to 1: how probable it is that the pose is right. Calibrated for the verdict `dense` (see [`crate::Calibration`]); else one
    /// half at the border between the verdicts.
    pub confidence: f64,
    /// By the configured metric.
    pub score: Option<f64>,
    /// Decimal logarithm of the number of random poses that would have as many inliers, among all that were tried.
    pub log10_false_alarms: Option<f64>,
    /// From where each scan was taken to be seen, file coordinates where one viewpoint explains it, and whether the side
    /// that the normals point to is sure.
    pub views: Option<Pair<Oriented>>,
    /// How firmly the surfaces hold the pose where they touch.
    pub hold: Option<Hold>,
    /// What the confidence was computed from, where the ranking looked at the surfaces.
    pub predictors: Option<Predictors>,
    /// How good the pose is, target's file coordinates, where it was refined and enough of the surfaces touches to tell.
    pub uncertainty: Option<Uncertainty>,
    /// How the surfaces lie on each other, where the ranking looked at that.
    pub agreement: Option<Agreement>,
    /// What each stage left.
    pub counts: Counts,
    /// Mean resolution of the scans as they came, data units.
    pub raw_resolution: f64,
    /// What `pr` meant in all stages after sampling, data units. Zero if sampling failed.
    pub resolution: f64,
    /// Wall time of each stage that ran.
    pub timings: Vec<StageTime>,
}

/// How an attempt was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The configuration with what the attempt changes in it.
    pub config: PipelineConfig,
    /// Of the normals.
    pub signs: Signs,
}

impl Registration {
    /// Why the verdict is not `Ok`; nothing where it is.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        match &self.verdict {
            Verdict::Ok => None,
            Verdict::Ambiguous => {
                let others = self.alternatives.len();
                Some(format!(
                    "{others} substantially different poses fit nearly as well: the scene is symmetric or repeats itself; an initial guess or more overlap would tell them apart"
                ))
            }
            Verdict::Failed(failure) => Some(failure.to_string()),
        }
    }
}
