//! How far the confidence can be trusted, and the coefficients that make it so.
//!
//! Registrations with a known truth become rows; [`fit`] makes a [`Calibration`](congruent_pipeline::Calibration) of them, [`Validation`] says what such a
//! calibration is worth on pairs that it has not seen.

mod logistic;
mod validation;

pub use logistic::fit;
pub use validation::Validation;

use congruent_pipeline::{DenseVerdictConfig, Predictors, Registration, Verdict};
use serde::{Deserialize, Serialize};

/// A pose is right if it is off by less than this, `pr`.
pub const RIGHT_WITHIN_PR: f64 = 5.0;

/// Where a pair comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// A data set lists it.
    Listed,
    /// The same, each scan under a motion of its own.
    Moved,
    /// Two scans of one data set that it does not list, since they share too little; the truth follows from the others.
    Unlisted,
    /// Scans of different objects, brought to one resolution: no pose is right.
    Crossed,
    /// Virtual scans.
    Simulated,
    /// Virtual scans of shapes that leave the pose open: an answer may be right by chance, but must not be called `ok`.
    Open,
}

/// One registration whose truth is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRow {
    /// Names the pair, unique.
    pub id: String,
    /// Pairs with one group have scans in common and are never on both sides of a validation.
    pub group: String,
    /// Where the pair comes from.
    pub origin: Origin,
    /// How far the pose is off, `pr`; nothing where there is no pose or no pose is right.
    pub error_pr: Option<f64>,
    /// What the program said.
    pub verdict: String,
    /// And how sure it was.
    pub confidence: f64,
    /// Whether the surfaces hold the pose.
    pub held: bool,
    /// What it knew; nothing where there was no pose.
    pub predictors: Option<Predictors>,
}

impl CalibrationRow {
    /// From an answer; `error_pr` is how far its pose is off.
    #[must_use]
    pub fn new(
        (id, group, origin): (String, String, Origin),
        registration: &Registration,
        error_pr: Option<f64>,
        verdict: &DenseVerdictConfig,
    ) -> Self {
        let held = registration.hold.is_some_and(|hold| hold.n_free(verdict.min_stiffness) == 0);
        let word = match registration.verdict {
            Verdict::Ok => "ok",
            Verdict::Ambiguous => "ambiguous",
            Verdict::Failed(_) => "failed",
        };
        CalibrationRow {
            id,
            group,
            origin,
            error_pr,
            verdict: word.to_owned(),
            confidence: registration.confidence,
            held,
            predictors: registration.predictors,
        }
    }

    /// Whether the surfaces hold the pose and no other pose is nearly as good.
    #[must_use]
    pub fn is_unique(&self, verdict: &DenseVerdictConfig) -> bool {
        let second = |known: &Predictors| known.runner_up * known.score;
        self.held && self.predictors.is_some_and(|known| !verdict.is_rival(second(&known), known.score))
    }

    /// Whether the pose is right.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.error_pr.is_some_and(|error| error < RIGHT_WITHIN_PR)
    }

    /// The model learns from answers that could be right or wrong.
    fn teaches(&self) -> bool {
        self.predictors.is_some() && self.origin != Origin::Open
    }
}
