//! Is the answer to be believed?
//!
//! Four things are asked: are there more inliers than chance explains ([`Significance`]); how probable is a right answer,
//! from how the surfaces lie on each other ([`Calibration`]); do the surfaces hold the pose where they touch; and is there
//! another pose that is nearly as good.

mod calibration;
mod significance;

pub use calibration::{Calibration, MAX_RESIDUAL_PR, N_TERMS, Predictors};
pub(crate) use significance::Significance;

use crate::chain::Chosen;
use crate::ranking::Ranked;
use crate::{AContrarioConfig, DenseVerdictConfig, Failure, VerdictConfig};
use congruent_geometry::Length;
use congruent_refinement::Hold;

/// What speaks for and against an answer.
pub(crate) struct Evident<'a> {
    pub(crate) chosen: &'a Chosen,
    pub(crate) significance: &'a Significance,
    pub(crate) hold: Hold,
    /// `pr`, data units.
    pub(crate) resolution: f64,
}

/// What is thought of an answer.
pub(crate) struct Judgement {
    /// 0 to 1: in this pose or one of its rivals; attempts are compared by it.
    pub(crate) confidence: f64,
    /// Why it is not believed.
    pub(crate) doubt: Option<Failure>,
    /// Other poses, between the centred clouds, that are nearly as good; the answer is then ambiguous.
    pub(crate) rivals: Vec<Ranked>,
    /// What the calibrated model looked at, where there was a dense ranking.
    pub(crate) predictors: Option<Predictors>,
}

impl Judgement {
    /// In this pose alone: those that are equally good share the confidence.
    pub(crate) fn confidence_alone(&self) -> f64 {
        self.confidence / (1 + self.rivals.len()) as f64
    }
}

impl VerdictConfig {
    /// Correspondences with a residual below it are inliers.
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

    pub(crate) fn judge(&self, evident: &Evident<'_>) -> Judgement {
        let better = |score: f64, best: f64| score > best;
        let predictors = evident.predictors();
        match (self, predictors) {
            (VerdictConfig::AContrario(config), _) => {
                evident.judged(evident.significance.judge(config), config.min_stiffness, &better, predictors)
            }
            (VerdictConfig::Dense(config), Some(known)) => {
                let believed = config.judge(&known, evident.significance.inliers);
                let is_rival = |score: f64, best: f64| config.is_rival(score, best);
                evident.judged(believed, config.min_stiffness, &is_rival, predictors)
            }
            // Without a dense ranking there is only chance to compare with.
            (VerdictConfig::Dense(config), None) => {
                let believed = evident.significance.judge(&AContrarioConfig::default());
                evident.judged(believed, config.min_stiffness, &better, None)
            }
        }
    }
}

impl Evident<'_> {
    fn predictors(&self) -> Option<Predictors> {
        let ranked = self.chosen.ranked.as_ref()?;
        let second = self.chosen.others.first().map_or(0.0, |other| other.score.value());
        let best = ranked.score.value();
        Some(Predictors {
            score: best,
            overlap: ranked.agreement.overlap,
            residual_pr: (ranked.agreement.residual / self.resolution).min(MAX_RESIDUAL_PR),
            contradictions: ranked.agreement.hover + ranked.agreement.occlusion,
            disagreeing: ranked.agreement.disagreeing,
            runner_up: if best > 0.0 { (second / best).min(1.0) } else { 1.0 },
            log10_false_alarms: self.significance.log10_false_alarms,
            stiffness: self.hold.stiffness[0],
            normal_angle: ranked.agreement.normal_angle,
        })
    }

    /// A pose that the surfaces do not hold is not believed, however well they lie on each other.
    fn judged(
        &self,
        (confidence, doubt): (f64, Option<Failure>),
        min_stiffness: f64,
        is_rival: &dyn Fn(f64, f64) -> bool,
        predictors: Option<Predictors>,
    ) -> Judgement {
        let n_free = self.hold.n_free(min_stiffness);
        let doubt = doubt.or((n_free > 0).then_some(Failure::Sliding {
            n_free,
            stiffness: self.hold.stiffness[0],
            needed: min_stiffness,
        }));
        let best = self.chosen.ranked.map_or(f64::INFINITY, |ranked| ranked.score.value());
        let rivals: Vec<Ranked> =
            self.chosen.others.iter().filter(|other| is_rival(other.score.value(), best)).copied().collect();
        let ceiling = if n_free > 0 { SLIDING_CONFIDENCE } else { 1.0 };
        Judgement { confidence: confidence.min(ceiling), doubt, rivals, predictors }
    }
}

/// Confidence in a pose that the geometry leaves open, at most.
pub const SLIDING_CONFIDENCE: f64 = 0.1;

impl DenseVerdictConfig {
    /// Confidence, and doubt where it is too little.
    fn judge(&self, known: &Predictors, inliers: usize) -> (f64, Option<Failure>) {
        let confidence = self.calibration.confidence(known);
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
