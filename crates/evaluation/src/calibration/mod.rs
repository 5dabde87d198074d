//! How far the confidence can be trusted, and the coefficients that make it so.
//!
//! Pairs with a known truth become rows with the outcome of every attempt, so that a row says what the program would answer
//! under any calibration. Two things do not follow from a row: the search for a more credible pose, which began where the
//! rows were made, and the attempt with the other side of uncertain normals before an answer is accepted. [`calibrated`]
//! makes a [`Calibration`] of the rows, and [`Validation`] says what such a calibration is worth on pairs that it has not seen.

mod logistic;
mod validation;

pub use logistic::fit;
pub use validation::Validation;

use congruent_pipeline::{Calibration, DenseVerdictConfig, Predictors, SLIDING_CONFIDENCE, Tried};
use serde::{Deserialize, Serialize};

/// A pose is right if it is off by less than this, `pr`.
pub const RIGHT_WITHIN_PR: f64 = 5.0;

/// Times that a calibration is made again from its own answers.
const SETTLING_ROUNDS: usize = 4;

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
    /// A listed pair whose source is seen in a mirror: no pose is right.
    Mirrored,
    /// Virtual scans.
    Simulated,
    /// Virtual scans of shapes that leave the pose open: an answer may be right by chance, but must not be called `ok`.
    Open,
}

/// A pair whose truth is known, and all that its attempts came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRow {
    /// Names the pair, unique.
    pub id: String,
    /// What its scans belong to: an object, a scene; at least one. A row is judged by a model that knows no row of its first group;
    /// of the object of the other scan, where that is another one, the model may know.
    pub groups: Vec<String>,
    /// Where the pair comes from.
    pub origin: Origin,
    /// Attempts that came to a pose, in their order.
    pub attempts: Vec<AttemptRow>,
}

/// An attempt, however believable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttemptRow {
    /// How far the pose is off, `pr`; nothing where no pose is right.
    pub error_pr: Option<f64>,
    /// Whether the surfaces hold the pose.
    pub is_held: bool,
    /// What is known of the pose.
    pub known: Predictors,
    /// And of the really different ones that come close to it, where the attempt was at all believable.
    pub close: Vec<Predictors>,
}

/// What the program would answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// How far its pose is off, `pr`; nothing where there is no pose or no pose is right.
    pub error_pr: Option<f64>,
    /// How sure it is.
    pub confidence: f64,
    /// What it knows; nothing where there is no pose.
    pub known: Option<Predictors>,
    /// Whether it says so: sure enough, held by the surfaces, and no other pose nearly as good.
    pub is_ok: bool,
}

impl Answer {
    /// Whether the pose is right.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.error_pr.is_some_and(|error| error < RIGHT_WITHIN_PR)
    }
}

impl AttemptRow {
    /// Nothing where the ranking did not look at the surfaces.
    #[must_use]
    pub fn new(tried: &Tried, error_pr: Option<f64>) -> Option<AttemptRow> {
        Some(AttemptRow { error_pr, is_held: tried.is_held, known: tried.predictors?, close: tried.close.clone() })
    }

    fn confidence(&self, calibration: &Calibration) -> f64 {
        calibration.confidence(&self.known).min(if self.is_held { 1.0 } else { SLIDING_CONFIDENCE })
    }

    fn is_alone(&self, verdict: &DenseVerdictConfig) -> bool {
        !self.close.iter().any(|close| verdict.is_rival(close, &self.known))
    }
}

impl CalibrationRow {
    /// Attempt after attempt, until one is believed; else the most believed one: as the program does it with these attempts.
    #[must_use]
    pub fn answer(&self, calibration: &Calibration, verdict: &DenseVerdictConfig) -> Answer {
        let verdict = &DenseVerdictConfig { calibration: calibration.clone(), ..verdict.clone() };
        let mut answer = Answer { error_pr: None, confidence: -1.0, known: None, is_ok: false };
        for attempt in &self.attempts {
            let confidence = attempt.confidence(calibration);
            if confidence > answer.confidence {
                let is_believed = confidence >= verdict.min_confidence && attempt.is_held;
                let (error_pr, known) = (attempt.error_pr, Some(attempt.known));
                answer = Answer { error_pr, confidence, known, is_ok: is_believed && attempt.is_alone(verdict) };
                if is_believed {
                    break;
                }
            }
        }
        Answer { confidence: answer.confidence.max(0.0), ..answer }
    }

    /// The model learns from answers that could be right or wrong.
    fn teaches(&self) -> bool {
        !self.attempts.is_empty() && self.origin != Origin::Open
    }
}

/// The calibration that explains its own answers best: which attempt answers depends on the calibration, so it is made
/// again from the answers of the last one a few times. Nothing is learned from `Open` rows.
#[must_use]
pub fn calibrated<'a>(
    rows: impl IntoIterator<Item = &'a CalibrationRow>,
    verdict: &DenseVerdictConfig,
    ridge: f64,
) -> Calibration {
    let rows: Vec<&CalibrationRow> = rows.into_iter().filter(|row| row.teaches()).collect();
    let attempts = rows.iter().flat_map(|row| &row.attempts);
    let is_right = |attempt: &AttemptRow| attempt.error_pr.is_some_and(|error| error < RIGHT_WITHIN_PR);
    let mut calibration = fit(attempts.map(|attempt| (attempt.known, is_right(attempt))), ridge);
    for _ in 0..SETTLING_ROUNDS {
        let answers = rows.iter().map(|row| row.answer(&calibration, verdict));
        calibration = fit(answers.filter_map(|answer| Some((answer.known?, answer.is_right()))), ridge);
    }
    calibration
}
