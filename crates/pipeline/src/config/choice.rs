//! User settings for the choice among poses and for the verdict on the chosen one.

use super::preparation::most_points_or_none;
use crate::{Calibration, Predictors};
use congruent_descriptors::DescriptorConfig;
use congruent_estimators::EstimatorConfig;
use congruent_geometry::Length;
use congruent_metrics::DenseRule;
use congruent_refinement::MIN_STIFFNESS;
use serde::{Deserialize, Serialize};

/// Settings of the pool of poses that are kept after estimation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PoolConfig {
    /// Maximum number of poses. One keeps only the best by the metric, which is the paper's rule.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub poses: usize,
    /// Poses that put the source's points closer together than this on average are regarded as the same.
    pub distinct: Length,
    /// Maximum number of rounds of local optimisation with the weights of the metric; zero for none.
    pub optimisation_rounds: usize,
}

/// How the answer is chosen from the pool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RankingConfig {
    /// By the metric: the best of the pool.
    None {},
    /// By how well the two surfaces fit each other, before and after a short refinement.
    Dense(DenseConfig),
}

/// Settings of `[ranking.dense]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct DenseConfig {
    /// Points closer than this overlap, before refinement …
    pub rough_distance: Length,
    /// … and after it.
    pub overlap_distance: Length,
    /// Minimum agreement of the normals of overlapping points (cosine).
    #[serde(deserialize_with = "congruent_geometry::numbers::cosine")]
    pub min_normal_cosine: f64,
    /// Minimum distance of hovering points from the surface behind them …
    pub hover_from: Length,
    /// … and their maximum distance.
    pub hover_to: Length,
    /// Points this far in front of what the other scanner saw would have hidden it.
    pub occlusion_depth: Length,
    /// Rate at which the score declines with the fraction of hovering points.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub hover_weight: f64,
    /// Rate at which the score declines with the fraction of occluding points.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub occlusion_weight: f64,
    /// Maximum number of points of each scan that are examined; two thirds of it before refinement.
    pub points: usize,
    /// Number of poses that are refined and examined again; at least one is.
    pub refined: usize,
    /// Maximum number of rounds of that refinement.
    pub rounds: usize,
}

/// When a pose is accepted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictConfig {
    /// If it has more inliers than chance explains.
    AContrario(AContrarioConfig),
    /// If the surfaces fit each other well enough. Needs `[ranking.dense]`.
    Dense(DenseVerdictConfig),
}

/// Settings of `[verdict.a-contrario]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct AContrarioConfig {
    /// Residuals below this are inliers.
    pub inlier_threshold: Length,
    /// Expected number of random poses this good among all trials below which the pose is accepted.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub max_false_alarms: f64,
    /// Stiffness from which a direction counts as held even if the normals are noisy; in a looser one the surfaces may
    /// slide along each other (see [`Hold::n_free`](congruent_refinement::Hold::n_free)).
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub min_stiffness: f64,
}

/// Settings of `[verdict.dense]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct DenseVerdictConfig {
    /// Minimum confidence of an accepted pose, 0 to 1.
    #[serde(deserialize_with = "congruent_geometry::numbers::probability")]
    pub min_confidence: f64,
    /// Stiffness from which a direction counts as held even if the normals are noisy; in a looser one the surfaces may
    /// slide along each other (see [`Hold::n_free`](congruent_refinement::Hold::n_free)).
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub min_stiffness: f64,
    /// A substantially different pose with more than this fraction of the answer's score may make the answer ambiguous.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub rival_score: f64,
    /// So may one with a score above this, however good the answer is: parts of a facade may fit other parts.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub rival_alone: f64,
    /// Such a pose makes the answer ambiguous unless its odds, after refinement and judged only by the surfaces, are
    /// lower than the answer's by more than this factor.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub rival_odds: f64,
    /// Coefficients of the confidence, as `congruent calibrate` writes them; the built-in ones if not given.
    #[serde(skip_serializing_if = "Calibration::is_default")]
    pub calibration: Calibration,
}

/// One further attempt, with other effort or other assumptions. What is not given stays as in the plain configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct EscalationStep {
    /// Replaces `sampling.budget.max-points`; no effect on other samplings.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "most_points_or_none")]
    pub max_points: Option<usize>,
    /// Replaces `pool.poses`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<usize>,
    /// Replaces `ranking.dense.refined`; no effect without a dense ranking.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refined: Option<usize>,
    /// Which side the normals point to.
    pub signs: Signs,
    /// Another descriptor. Its poses compete with those of the other attempts; its matches are never mixed with theirs.
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
    /// As determined from both scans.
    #[default]
    Kept,
    /// Turned on one scan whose signs are uncertain; the attempt is skipped if both are reliable.
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
    /// Returns the rule of the final score, with lengths in data units.
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

    /// Returns the rule for poses that are not refined yet: a larger distance and fewer points.
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
    /// Returns whether a substantially different pose of this score may make an answer of score `best` ambiguous.
    #[must_use]
    pub fn comes_close(&self, score: f64, best: f64) -> bool {
        score > self.rival_score * best || score > self.rival_alone
    }

    /// Returns whether a pose that comes close makes the answer ambiguous, judged by how the surfaces fit each other.
    /// The number of inliers is not considered: in scans sampled in the same pattern, correspondences tell apart parts
    /// that have the same shape. Nor is the number of poses from which either was chosen.
    #[must_use]
    pub fn is_rival(&self, rival: &Predictors, answer: &Predictors) -> bool {
        let Predictors { log10_false_alarms, chosen_from, .. } = *answer;
        let rival = Predictors { log10_false_alarms, chosen_from, ..*rival };
        let behind = self.calibration.log_odds(answer) - self.calibration.log_odds(&rival);
        // An undefined difference (NaN) counts as a rival.
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
