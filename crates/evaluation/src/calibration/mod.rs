//! How far the confidence can be trusted, and how its coefficients are fitted.
//!
//! Pairs with a known truth become rows with the results of every attempt, so that the answer of the program can be
//! derived from a row for any calibration. Two things cannot be derived: the search for a more probable pose, which
//! depended on the calibration in use when the rows were made, and the attempt with the other side of uncertain normals
//! before an answer is accepted. [`calibrated`] fits a [`Calibration`] to the rows, and [`Validation`] measures how
//! good such a calibration is on pairs that it has not seen.

mod logistic;
mod validation;

pub use logistic::fit;
pub use validation::Validation;

use congruent_pipeline::{Calibration, DenseVerdictConfig, Predictors, SLIDING_CONFIDENCE, Tried};
use serde::{Deserialize, Serialize};

/// A pose is right if its error is below this, `pr` of the scans as provided.
pub const RIGHT_WITHIN_PR: f64 = 5.0;

/// Number of times that a calibration is fitted again to its own answers.
const SETTLING_ROUNDS: usize = 4;

/// The origin of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Listed by a data set.
    Listed,
    /// A listed pair, each scan moved by a motion of its own.
    Moved,
    /// Two scans of a data set that does not list the pair because they share too little; the truth follows from listed
    /// pairs.
    Unlisted,
    /// Scans of different objects; those of data sets are brought to one resolution. No pose is right.
    Crossed,
    /// A listed pair whose source is mirrored: no pose is right.
    Mirrored,
    /// Simulated scans.
    Simulated,
    /// Simulated scans of shapes that do not determine the pose: an answer may be right by chance, but must not be
    /// called `ok`.
    Open,
}

/// A pair whose truth is known, with the results of all its attempts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRow {
    /// Unique name of the pair.
    pub id: String,
    /// What its scans belong to, for instance an object or a scene; at least one. A row is judged by a model that was
    /// not fitted to any row of its first group; if the other scan belongs to another group, the model may have been
    /// fitted to rows of that one.
    pub groups: Vec<String>,
    /// The origin of the pair.
    pub origin: Origin,
    /// Attempts that yielded a pose, in their order.
    pub attempts: Vec<AttemptRow>,
}

/// The result of an attempt, whatever its confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttemptRow {
    /// Error of the pose, `pr` of the scans as provided; `None` if no pose is right.
    pub error_pr: Option<f64>,
    /// Whether the surfaces hold the pose.
    pub is_held: bool,
    /// The measurements of the pose.
    pub known: Predictors,
    /// The measurements of substantially different poses that come close to it; empty unless the attempt had a minimum
    /// confidence when the row was made.
    pub close: Vec<Predictors>,
}

/// The answer that the program would give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Error of its pose, `pr`; `None` if there is no pose or no pose is right.
    pub error_pr: Option<f64>,
    /// Confidence in the pose or one of its rivals, 0 to 1; zero if there is no pose.
    pub confidence: f64,
    /// The measurements of the pose; `None` if there is no pose.
    pub known: Option<Predictors>,
    /// Whether the verdict is `ok`: enough confidence, held by the surfaces, and no other pose nearly as good.
    pub is_ok: bool,
}

impl Answer {
    /// Returns whether the pose is right.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.error_pr.is_some_and(|error| error < RIGHT_WITHIN_PR)
    }
}

impl AttemptRow {
    /// Creates the row of an attempt; `None` if there was no dense ranking.
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
    /// Returns the answer that the program would give with these attempts: the first attempt that is accepted or
    /// ambiguous, or else the one with the highest confidence. `calibration` replaces that of `verdict`.
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

    /// Returns whether a model is fitted to this row: only if its answer could be right or wrong.
    fn teaches(&self) -> bool {
        !self.attempts.is_empty() && self.origin != Origin::Open
    }
}

/// Fits the calibration to its own answers: which attempt gives the answer depends on the calibration, so it is fitted
/// again to the answers of the previous one a few times. `Open` rows are not used.
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
