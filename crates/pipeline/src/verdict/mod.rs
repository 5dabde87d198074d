//! Whether the answer is accepted.
//!
//! Four questions are asked: are there more inliers than chance explains ([`Significance`]); how probable is it, from
//! how well the surfaces fit each other, that the answer is right ([`Calibration`]); do the surfaces hold the pose
//! where they touch; and is there another pose that is nearly as good?

mod calibration;
mod significance;

pub(crate) use calibration::{CONTRADICTED_CONFIDENCE, POWERS_OF_PLANES};
pub use calibration::{Calibration, MAX_RESIDUAL_PR, N_TERMS, Predictors};
pub(crate) use significance::Significance;

use crate::ranking::Ranked;
use crate::{AContrarioConfig, DenseVerdictConfig, Failure, VerdictConfig};
use congruent_geometry::Length;
use congruent_refinement::Hold;

/// How a pose stands among the others of its attempt.
#[derive(Clone, Copy)]
pub(crate) struct Standing {
    /// How well the surfaces fit each other, if the ranking measured it.
    pub(crate) ranked: Option<Ranked>,
    /// Score of the best substantially different pose.
    pub(crate) second: f64,
    /// Number of poses among which this one has the highest confidence; 1 if confidence played no part in the choice.
    pub(crate) chosen_from: u32,
}

/// What is known about a pose.
pub(crate) struct Evident {
    pub(crate) standing: Standing,
    pub(crate) significance: Significance,
    pub(crate) hold: Hold,
    /// Flatness of the touching surface; zero if it does not matter.
    pub(crate) flatness: f64,
    /// `pr`, data units.
    pub(crate) resolution: f64,
}

/// The judgement of an answer.
pub(crate) struct Judgement {
    /// Probability that this pose or one of its rivals is right, 0 to 1; attempts are compared by it.
    pub(crate) confidence: f64,
    /// Why the answer is not accepted, if it is not.
    pub(crate) doubt: Option<Failure>,
    /// The input of the calibrated model, if there was a dense ranking.
    pub(crate) predictors: Option<Predictors>,
    /// Other poses, between the centred clouds, that are nearly as good; if there are any, the answer is ambiguous.
    pub(crate) rivals: Vec<Ranked>,
    /// The measurements of the candidate rivals that were examined, including those that were dropped.
    pub(crate) examined: Vec<Predictors>,
}

impl Judgement {
    /// Returns the confidence in this pose alone: equally good poses share the confidence.
    pub(crate) fn confidence_alone(&self) -> f64 {
        self.confidence / (1 + self.rivals.len()) as f64
    }
}

impl VerdictConfig {
    /// Returns the residual below which correspondences are inliers.
    #[must_use]
    pub fn inlier_threshold(&self) -> Length {
        match self {
            VerdictConfig::AContrario(c) => c.inlier_threshold,
            VerdictConfig::Dense(_) => AContrarioConfig::default().inlier_threshold,
        }
    }

    pub(crate) fn min_stiffness(&self) -> f64 {
        match self {
            VerdictConfig::AContrario(c) => c.min_stiffness,
            VerdictConfig::Dense(c) => c.min_stiffness,
        }
    }

    /// Judges a pose by itself. One that the surfaces do not hold is not accepted, however well they fit each other.
    pub(crate) fn judge(&self, evident: &Evident) -> Judgement {
        let predictors = evident.predictors();
        let inliers = evident.significance.inliers;
        let (confidence, doubt) = match (self, &predictors) {
            (VerdictConfig::AContrario(config), _) => evident.significance.judge(config),
            (VerdictConfig::Dense(config), Some(known)) => config.judge(known, inliers),
            // Without a dense ranking only chance remains as a criterion.
            (VerdictConfig::Dense(_), None) => evident.significance.judge(&AContrarioConfig::default()),
        };
        let needed = self.min_stiffness();
        let n_free = evident.hold.n_free(needed);
        let sliding = Failure::Sliding { n_free, stiffness: evident.hold.stiffness[0], needed };
        Judgement {
            confidence: confidence.min(if n_free > 0 { SLIDING_CONFIDENCE } else { 1.0 }),
            doubt: doubt.or((n_free > 0).then_some(sliding)),
            predictors,
            rivals: Vec::new(),
            examined: Vec::new(),
        }
    }

    /// Returns whether a substantially different pose of this score may be as good as an answer of score `best`.
    pub(crate) fn comes_close(&self, score: f64, best: f64) -> bool {
        match self {
            VerdictConfig::AContrario(_) => score > best,
            VerdictConfig::Dense(config) => config.comes_close(score, best),
        }
    }

    /// Returns whether a pose that comes close is as good as the answer, after both have been refined and measured
    /// alike: as probable for the verdict `dense`; otherwise of no lower score, with more inliers than chance explains.
    pub(crate) fn is_rival(&self, rival: &Predictors, answer: &Predictors) -> bool {
        match self {
            VerdictConfig::Dense(config) => config.is_rival(rival, answer),
            VerdictConfig::AContrario(config) => {
                rival.score >= answer.score && rival.log10_false_alarms <= config.max_false_alarms.log10()
            }
        }
    }
}

impl Evident {
    pub(crate) fn predictors(&self) -> Option<Predictors> {
        let Standing { ranked, second, chosen_from } = self.standing;
        let ranked = ranked?;
        let score = ranked.score.value();
        Some(Predictors {
            score,
            overlap: ranked.agreement.overlap,
            residual_pr: (ranked.agreement.residual / self.resolution).min(MAX_RESIDUAL_PR),
            contradictions: ranked.agreement.contradictions(),
            disagreeing: ranked.agreement.disagreeing,
            runner_up: if score > 0.0 { (second / score).min(1.0) } else { 1.0 },
            log10_false_alarms: self.significance.log10_false_alarms,
            stiffness: self.hold.stiffness[0],
            normal_angle: ranked.agreement.normal_angle,
            chosen_from,
            flatness: self.flatness,
        })
    }
}

/// Maximum confidence in a pose that the surfaces do not hold in every direction.
pub const SLIDING_CONFIDENCE: f64 = 0.1;

impl DenseVerdictConfig {
    /// Returns the confidence, and the doubt if it is too low.
    fn judge(&self, known: &Predictors, inliers: usize) -> (f64, Option<Failure>) {
        let confidence = self.calibration.confidence(known);
        if known.are_only_planes() && confidence < self.min_confidence {
            let powers = -known.log10_false_alarms;
            let doubt = Failure::OnlyPlanes { flatness: known.flatness, powers, needed: POWERS_OF_PLANES };
            return (confidence, Some(doubt));
        }
        let doubt = (confidence < self.min_confidence).then_some(Failure::PoorFit {
            confidence,
            needed: self.min_confidence,
            overlap: known.overlap,
            residual: known.residual_pr,
            contradictions: known.contradictions,
            inliers,
        });
        (confidence, doubt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_chance_alone_a_rival_is_as_good_and_no_accident() {
        let verdict = VerdictConfig::AContrario(AContrarioConfig::default());
        let known = |score: f64, log10_false_alarms: f64| Predictors {
            score,
            overlap: 0.5,
            residual_pr: 0.4,
            contradictions: 0.0,
            disagreeing: 0.0,
            runner_up: 0.5,
            log10_false_alarms,
            stiffness: 0.1,
            normal_angle: 0.1,
            chosen_from: 1,
            flatness: 0.0,
        };
        let answer = known(10.0, -40.0);
        for (score, log10_false_alarms, expected) in
            [(10.0, -40.0, true), (12.0, -9.0, true), (12.0, 3.0, false), (9.0, -40.0, false)]
        {
            assert_eq!(verdict.is_rival(&known(score, log10_false_alarms), &answer), expected, "{score}");
        }
    }
}
