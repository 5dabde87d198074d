//! What a user may say about choosing among poses, and believing the chosen one.

use super::preparation::most_points_or_none;
use crate::{Calibration, Predictors};
use congruent_descriptors::DescriptorConfig;
use congruent_estimators::EstimatorConfig;
use congruent_geometry::Length;
use congruent_metrics::DenseRule;
use congruent_refinement::MIN_STIFFNESS;
use serde::{Deserialize, Serialize};

/// The poses that outlive the correspondences.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PoolConfig {
    /// At most so many are kept. One keeps the best by the metric: the paper's rule.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub poses: usize,
    /// Poses that put the source's points closer together than this, on the mean, are the same.
    pub distinct: Length,
    /// Rounds of local optimisation by the metric's own weights; zero for none.
    pub optimisation_rounds: usize,
}

/// How the answer is chosen among the pool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RankingConfig {
    /// By the metric: the first of the pool.
    None {},
    /// By how well the two surfaces lie on each other, before and after a short refinement.
    Dense(DenseConfig),
}

/// Settings of `[ranking.dense]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct DenseConfig {
    /// Points closer than this overlap, before refinement.
    pub rough_distance: Length,
    /// And after it.
    pub overlap_distance: Length,
    /// If their normals agree at least so well (cosine).
    #[serde(deserialize_with = "congruent_geometry::numbers::cosine")]
    pub min_normal_cosine: f64,
    /// A point hovers before a surface from this distance …
    pub hover_from: Length,
    /// … to this.
    pub hover_to: Length,
    /// A point this far before what the other scanner saw would have hidden it.
    pub occlusion_depth: Length,
    /// Decline of the score with the share of hovering points.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub hover_weight: f64,
    /// Decline of the score with the share of hiding points.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub occlusion_weight: f64,
    /// Points of each scan that are looked at.
    pub points: usize,
    /// Poses that are refined and looked at again.
    pub refined: usize,
    /// Rounds of that refinement.
    pub rounds: usize,
}

/// When a pose is believed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictConfig {
    /// When it has more inliers than chance explains.
    AContrario(AContrarioConfig),
    /// When the surfaces lie on each other well enough. Needs `[ranking.dense]`.
    Dense(DenseVerdictConfig),
}

/// Settings of `[verdict.a-contrario]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct AContrarioConfig {
    /// Residuals below it are inliers.
    pub inlier_threshold: Length,
    /// Random poses as good as this one that may be expected among all trials.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub max_false_alarms: f64,
    /// Stiffness that every direction must have; in a looser one the surfaces slide on each other.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub min_stiffness: f64,
}

/// Settings of `[verdict.dense]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct DenseVerdictConfig {
    /// Confidence from which a pose is believed, 0 to 1.
    #[serde(deserialize_with = "congruent_geometry::numbers::probability")]
    pub min_confidence: f64,
    /// Stiffness that every direction must have; in a looser one the surfaces slide on each other.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub min_stiffness: f64,
    /// A really different pose with more than this share of the best score may make the answer ambiguous.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub rival_score: f64,
    /// So may one with more than this score, however good the best is: parts of a facade that lie on other parts.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub rival_alone: f64,
    /// It does, unless its odds by the surfaces alone, once it is refined like the answer, are less than the answer's by this
    /// factor.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub rival_odds: f64,
    /// Coefficients of the confidence, as `congruent calibrate` writes them; those that come with the program if not given.
    #[serde(skip_serializing_if = "Calibration::is_default")]
    pub calibration: Calibration,
}

/// One more attempt, with other effort or other assumptions. What is left out stays as in the first attempt.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct EscalationStep {
    /// For `sampling.budget.max-points`.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "most_points_or_none")]
    pub max_points: Option<usize>,
    /// For `pool.poses`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<usize>,
    /// For `ranking.dense.refined`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refined: Option<usize>,
    /// Of the normals.
    pub signs: Signs,
    /// Another descriptor: its poses compete with those of the first, its matches are never mixed with them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub descriptor: Option<DescriptorConfig>,
    /// Another estimator, or the same with other settings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimator: Option<EstimatorConfig>,
}

/// The signs of the normals in one attempt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Signs {
    /// As they were settled.
    #[default]
    Kept,
    /// Turned round on a scan whose signs are unsure; no attempt where both are sure.
    Other,
}

impl Default for PoolConfig {
    fn default() -> Self {
        PoolConfig { poses: 300, distinct: Length::Resolutions(6.0), optimisation_rounds: 10 }
    }
}

impl Default for DenseConfig {
    fn default() -> Self {
        DenseConfig {
            rough_distance: Length::Resolutions(4.0),
            overlap_distance: Length::Resolutions(3.0),
            min_normal_cosine: 0.6,
            hover_from: Length::Resolutions(6.0),
            hover_to: Length::Resolutions(24.0),
            occlusion_depth: Length::Resolutions(5.0),
            hover_weight: 20.0,
            occlusion_weight: 20.0,
            points: 1500,
            refined: 50,
            rounds: 15,
        }
    }
}

impl DenseConfig {
    /// The rule of the final score.
    pub(crate) fn rule(&self, resolution: f64) -> DenseRule {
        DenseRule {
            overlap_distance: self.overlap_distance.resolve(resolution),
            min_normal_cosine: self.min_normal_cosine,
            hover_from: self.hover_from.resolve(resolution),
            hover_to: self.hover_to.resolve(resolution),
            occlusion_depth: self.occlusion_depth.resolve(resolution),
            hover_weight: self.hover_weight,
            occlusion_weight: self.occlusion_weight,
            max_points: self.points,
        }
    }

    /// The rule for poses that are not refined yet: wider, and with fewer points.
    pub(crate) fn rough_rule(&self, resolution: f64) -> DenseRule {
        DenseRule {
            overlap_distance: self.rough_distance.resolve(resolution),
            max_points: self.points * 2 / 3,
            ..self.rule(resolution)
        }
    }
}

impl Default for VerdictConfig {
    fn default() -> Self {
        VerdictConfig::Dense(DenseVerdictConfig::default())
    }
}

impl Default for AContrarioConfig {
    fn default() -> Self {
        AContrarioConfig {
            inlier_threshold: Length::Resolutions(7.5),
            max_false_alarms: 1e-3,
            min_stiffness: MIN_STIFFNESS,
        }
    }
}

impl DenseVerdictConfig {
    /// Whether a really different pose of this score may make an answer of score `best` ambiguous.
    #[must_use]
    pub fn comes_close(&self, score: f64, best: f64) -> bool {
        score > self.rival_score * best || score > self.rival_alone
    }

    /// Whether one that comes close does, by how the surfaces lie on each other. How many correspondences agree is no argument:
    /// scans that were sampled alike tell parts of a shape apart that are the same. Nor is among how many it was chosen.
    #[must_use]
    pub fn is_rival(&self, rival: &Predictors, answer: &Predictors) -> bool {
        let Predictors { log10_false_alarms, chosen_from, .. } = *answer;
        let rival = Predictors { log10_false_alarms, chosen_from, ..*rival };
        let behind = self.calibration.log_odds(answer) - self.calibration.log_odds(&rival);
        // What is no number is a rival.
        behind.is_nan() || behind <= self.rival_odds.ln()
    }
}

impl Default for DenseVerdictConfig {
    fn default() -> Self {
        DenseVerdictConfig {
            min_confidence: 0.8,
            min_stiffness: MIN_STIFFNESS,
            rival_score: 0.8,
            rival_alone: 0.2,
            rival_odds: 20.0,
            calibration: Calibration::default(),
        }
    }
}
