//! The probability that an answer is right: a logistic model of its measurements.
//!
//! The coefficients are in `calibration.toml`; `congruent calibrate` creates that file from registrations whose truth
//! is known: true pairs, pairs of different objects, and pairs that hardly overlap, from several sensors.

use congruent_geometry::MOSTLY_FLAT;
use serde::{Deserialize, Serialize};

/// The measurements by which a right answer is recognised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Predictors {
    /// Score of the ranking: overlap, discounted for every contradiction; 0 to 1.
    pub score: f64,
    /// Fraction of the points that touch the other surface with normals that agree, averaged over both directions.
    pub overlap: f64,
    /// Mean distance of those points to the other surface's tangent plane, `pr`; at most [`MAX_RESIDUAL_PR`], which is
    /// also the value if nothing touches.
    pub residual_pr: f64,
    /// Fraction of the points that hover in front of the other surface, plus the fraction that would have hidden it,
    /// each summed over both directions.
    pub contradictions: f64,
    /// Fraction of the points that touch with normals that disagree, averaged over both directions.
    pub disagreeing: f64,
    /// Score of the best substantially different pose, as a fraction of the answer's; at most one, and one if the
    /// answer's score is zero.
    pub runner_up: f64,
    /// Decimal logarithm of the expected number of random poses with as many inliers.
    pub log10_false_alarms: f64,
    /// Stiffness of the loosest direction.
    pub stiffness: f64,
    /// Mean angle between the normals where the surfaces touch, radians.
    pub normal_angle: f64,
    /// Number of poses among which this one has the highest confidence; 1 if confidence played no part in the choice.
    pub chosen_from: u32,
    /// Fraction of the source, or of the part of it that touches if that is less, that faces only three directions (see
    /// [`flatness`](congruent_geometry::flatness)). Zero if the correspondences exclude chance so clearly, or a guess
    /// leaves so few poses, that it does not matter.
    #[serde(default)]
    pub flatness: f64,
}

/// Planes fit each other in many poses, so that the surfaces tell little; the correspondences must exclude chance by
/// this many powers of ten. Of simulated views of rooms, houses and brackets whose answer would be accepted otherwise,
/// a third of those with fewer powers are right, and nine in ten of those with more.
pub(crate) const POWERS_OF_PLANES: f64 = 15.0;
/// Maximum confidence in a pose that only planes support and that correspondences do not distinguish from chance, …
const FLAT_CONFIDENCE: f64 = 0.3;
/// … and in one that much contradicts.
pub(crate) const CONTRADICTED_CONFIDENCE: f64 = 0.3;
/// Contradictions above this, as a fraction of the overlap, are many: right answers on real scans have at most 0.24, those
/// on simulated sweeps of spinning LiDARs at most 0.22, and wrong ones that align the rings of two sweeps 0.22 to 0.54.
const MANY_CONTRADICTIONS: f64 = 0.3;

/// Number of terms of the model besides the intercept.
pub const N_TERMS: usize = 7;
/// Scores below this are treated as equal.
const MIN_SCORE: f64 = 1e-3;
/// Scores below this are small: so little touches that chance may make it fit well. Above it, a larger overlap does not
/// make the answer more probable.
const SMALL_SCORE: f64 = 0.05;
/// Residuals above this, `pr`, are treated as equal.
pub const MAX_RESIDUAL_PR: f64 = 2.0;

/// Stiffnesses below this are treated as equal.
const SMALLEST_STIFFNESS: f64 = 1e-4;

/// Normals that disagree show how noisy the scans are, and thus how far apart right surfaces may be; larger fractions
/// than this tell nothing more.
const MAX_DISAGREEING: f64 = 0.05;
/// So do angles between normals, up to this, radians.
const MAX_NORMAL_ANGLE: f64 = 0.4;

/// Approximate maximum number of powers of ten by which random poses are excluded if different objects with the same
/// parts are aligned (102 is the most in 80 registrations of similar objects) …
const POWERS_OF_ALIKE: f64 = 100.0;
/// … and this many powers beyond it count as much as a factor of e below it.
const POWERS_A_FOLD: f64 = 50.0;

impl Predictors {
    /// Returns whether the touching surfaces are mostly planes, and the correspondences do not compensate for that.
    #[must_use]
    pub fn are_only_planes(&self) -> bool {
        self.flatness >= MOSTLY_FLAT && -self.log10_false_alarms < POWERS_OF_PLANES
    }

    /// Returns whether many points contradict the pose, compared with those that support it.
    #[must_use]
    pub fn are_contradicted(&self) -> bool {
        self.contradictions > MANY_CONTRADICTIONS * self.overlap
    }

    /// Returns the terms of the model, in the order of [`Calibration::weights`].
    #[must_use]
    pub fn terms(&self) -> [f64; N_TERMS] {
        let score = self.score.max(MIN_SCORE);
        [
            (SMALL_SCORE / score).max(1.0).ln(),
            self.residual_pr,
            self.disagreeing.min(MAX_DISAGREEING),
            self.contradictions,
            excluded((-self.log10_false_alarms).max(0.0)),
            self.stiffness.max(SMALLEST_STIFFNESS).ln(),
            self.normal_angle.min(MAX_NORMAL_ANGLE),
        ]
    }
}

/// Returns the value of the powers of ten by which random poses are excluded. Each counts less than the one before,
/// except for those beyond what objects that are only similar reach, which count equally.
fn excluded(powers: f64) -> f64 {
    powers.min(POWERS_OF_ALIKE).ln_1p() + (powers - POWERS_OF_ALIKE).max(0.0) / POWERS_A_FOLD
}

/// Coefficients of the model: the intercept, and one for each term.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Calibration {
    /// Log odds if all terms are zero.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub intercept: f64,
    /// Per natural logarithm of the factor by which the score is smaller than 0.05.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub ln_smallness: f64,
    /// Per `pr` of mean distance where the surfaces touch.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub residual: f64,
    /// Per unit of the fraction of points that touch with normals that disagree.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub disagreeing: f64,
    /// Per unit of the fraction of points that hover or occlude.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub contradictions: f64,
    /// Per natural logarithm of one plus the powers of ten by which random poses are excluded; beyond a hundred, per
    /// fifty powers.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub ln_powers_of_ten: f64,
    /// Per natural logarithm of the stiffness of the loosest direction.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub ln_stiffness: f64,
    /// Per radian of mean angle between the normals where the surfaces touch. Like the fraction that disagree, it shows
    /// how noisy the scans are, and thus how far apart right surfaces may be.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub normal_angle: f64,
}

impl Calibration {
    /// Creates a calibration from an intercept and the weights of [`Predictors::terms`].
    #[must_use]
    pub fn new(intercept: f64, weights: [f64; N_TERMS]) -> Calibration {
        let [ln_smallness, residual, disagreeing, contradictions, ln_powers_of_ten, ln_stiffness, normal_angle] =
            weights;
        Calibration {
            intercept,
            ln_smallness,
            residual,
            disagreeing,
            contradictions,
            ln_powers_of_ten,
            ln_stiffness,
            normal_angle,
        }
    }

    /// Returns the weights, in the order of [`Predictors::terms`].
    #[must_use]
    pub fn weights(&self) -> [f64; N_TERMS] {
        [
            self.ln_smallness,
            self.residual,
            self.disagreeing,
            self.contradictions,
            self.ln_powers_of_ten,
            self.ln_stiffness,
            self.normal_angle,
        ]
    }

    /// Returns whether these are the built-in coefficients.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Calibration::default()
    }

    /// Returns the probability that the answer is right, 0 to 1; at most 0.3 if only planes touch (see
    /// [`Predictors::are_only_planes`]) or much contradicts it ([`Predictors::are_contradicted`]).
    #[must_use]
    pub fn confidence(&self, known: &Predictors) -> f64 {
        let flat = if known.are_only_planes() { FLAT_CONFIDENCE } else { 1.0 };
        let contradicted = if known.are_contradicted() { CONTRADICTED_CONFIDENCE } else { 1.0 };
        (1.0 / (1.0 + (-self.log_odds(known)).exp())).min(flat).min(contradicted)
    }

    /// Returns the natural logarithm of the odds that the answer is right. Minus infinity if more of the points that
    /// touch have normals that disagree than normals that agree, as when walls lie on each other back to front. If
    /// several poses were examined for one to accept, finding one is easier, so the odds are divided by their number.
    #[must_use]
    pub fn log_odds(&self, known: &Predictors) -> f64 {
        if known.disagreeing > known.overlap {
            return f64::NEG_INFINITY;
        }
        let alone = self.intercept + self.weights().iter().zip(known.terms()).map(|(w, x)| w * x).sum::<f64>();
        alone - f64::from(known.chosen_from.max(1)).ln()
    }
}

impl Default for Calibration {
    fn default() -> Self {
        toml::from_str(include_str!("calibration.toml")).expect("the file that comes with the program is complete")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Predictors = Predictors {
        score: 0.6,
        overlap: 0.7,
        residual_pr: 0.1,
        contradictions: 0.001,
        disagreeing: 0.01,
        runner_up: 0.1,
        log10_false_alarms: -60.0,
        stiffness: 0.05,
        normal_angle: 0.1,
        chosen_from: 1,
        flatness: 0.0,
    };

    #[test]
    fn planes_need_correspondences_that_exclude_chance() {
        let calibration = Calibration::default();
        let known = |flatness: f64, log10_false_alarms: f64| {
            calibration.confidence(&Predictors { flatness, log10_false_alarms, ..GOOD })
        };
        assert!(known(0.5, -2.0) > 0.9 && known(0.9, -40.0) > 0.9);
        assert_eq!(known(0.9, -2.0), FLAT_CONFIDENCE);
    }

    #[test]
    fn what_much_contradicts_is_not_believed() {
        let calibration = Calibration::default();
        let known = |contradictions: f64| {
            calibration.confidence(&Predictors { contradictions, overlap: 0.3, log10_false_alarms: -300.0, ..GOOD })
        };
        assert!(known(0.07) > 0.9);
        assert_eq!(known(0.11), CONTRADICTED_CONFIDENCE);
    }

    #[test]
    fn confidence_is_the_logistic_function_of_the_weighted_terms() {
        let calibration = Calibration::new(0.5, [-0.7, -2.0, -10.0, -20.0, 0.5, 2.0, 3.0]);
        let log_odds = 0.5 - 0.2 - 0.1 - 0.02 + 0.5 * 61f64.ln() + 2.0 * 0.05f64.ln() + 3.0 * 0.1;
        assert!((calibration.confidence(&GOOD) - 1.0 / (1.0 + (-log_odds).exp())).abs() < 1e-12);
        let of_six = calibration.log_odds(&Predictors { chosen_from: 6, ..GOOD });
        assert!((of_six - (log_odds - 6f64.ln())).abs() < 1e-12);
    }

    #[test]
    fn hundreds_of_powers_of_ten_outweigh_a_rough_fit() {
        assert_eq!(excluded(0.0), 0.0);
        assert!((excluded(POWERS_OF_ALIKE) - 101f64.ln()).abs() < 1e-12);
        assert!((excluded(POWERS_OF_ALIKE + 3.0 * POWERS_A_FOLD) - excluded(POWERS_OF_ALIKE) - 3.0).abs() < 1e-12);
        let rough = Predictors { residual_pr: 0.65, normal_angle: 0.15, contradictions: 0.02, ..GOOD };
        let calibration = Calibration::default();
        let confidence = |log10_false_alarms| calibration.confidence(&Predictors { log10_false_alarms, ..rough });
        assert!(confidence(-100.0) < 0.5 && confidence(-300.0) > 0.9, "{} {}", confidence(-100.0), confidence(-300.0));
    }

    #[test]
    fn what_speaks_against_an_answer_lowers_the_confidence() {
        let calibration = Calibration::default();
        let confidence = calibration.confidence(&GOOD);
        assert!(confidence > 0.99);
        for worse in [
            Predictors { score: 0.005, ..GOOD },
            Predictors { residual_pr: MAX_RESIDUAL_PR, ..GOOD },
            Predictors { log10_false_alarms: 2.0, ..GOOD },
        ] {
            assert!(calibration.confidence(&worse) < confidence, "{worse:?}");
        }
        let back_to_front = Predictors { overlap: 0.1, disagreeing: 0.7, ..GOOD };
        assert_eq!(calibration.confidence(&back_to_front), 0.0);
    }
}
