//! All user settings of the chain. The defaults are defined here and in the configurations of the stages.

mod choice;
mod preparation;
mod preset;

pub use choice::{
    AContrarioConfig, DenseConfig, DenseVerdictConfig, EscalationStep, PoolConfig, RankingConfig, Signs, VerdictConfig,
};
pub use preparation::{
    BudgetConfig, NeighborhoodConfig, NormalSource, NormalsConfig, SamplingConfig, Strays, VoxelGridConfig,
};
pub use preset::Preset;

use congruent_descriptors::{DescriptorConfig, FpfhConfig, FpfhVariant, FrameConfig, ShotConfig, ToldiFrameConfig};
use congruent_estimators::{EstimatorConfig, PivotsConfig};
use congruent_geometry::Length;
use congruent_keypoints::{DetectorConfig, SupportFilter, UniformConfig};
use congruent_matching::{MatcherConfig, MutualConfig};
use congruent_metrics::MetricConfig;
use congruent_refinement::RefinementConfig;
use serde::{Deserialize, Serialize};

/// Settings of the whole chain. The meaning of `pr` is determined by `sampling`: see [`SamplingConfig`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PipelineConfig {
    /// Seed of all random draws.
    pub seed: u64,
    /// Thinning of the scans before anything else.
    pub sampling: SamplingConfig,
    /// Surface normals for descriptors.
    pub normals: NormalsConfig,
    /// The keypoint detector.
    pub detector: DetectorConfig,
    /// How much surface a keypoint needs around it.
    pub support: SupportFilter,
    /// The descriptor.
    pub descriptor: DescriptorConfig,
    /// Local reference frames, for the estimators that need them.
    pub frame: FrameConfig,
    /// The matcher.
    pub matcher: MatcherConfig,
    /// The estimator, which proposes poses.
    pub estimator: EstimatorConfig,
    /// The metric that scores them by the correspondences.
    pub metric: MetricConfig,
    /// Which of the best poses are kept.
    pub pool: PoolConfig,
    /// How the answer is chosen among the poses kept.
    pub ranking: RankingConfig,
    /// Refinement of the chosen pose.
    pub refinement: RefinementConfig,
    /// When the answer is accepted.
    pub verdict: VerdictConfig,
    /// Attempts to make first, with less effort; most pairs need no more.
    pub quick: Vec<EscalationStep>,
    /// Further attempts, one after the other until a pose is accepted or ambiguous.
    pub escalation: Vec<EscalationStep>,
}

impl Default for PipelineConfig {
    /// The robust chain: dense keypoints, mutual matches, a compatibility graph, many poses, and a choice by how well
    /// the surfaces fit each other.
    fn default() -> Self {
        PipelineConfig {
            seed: 0,
            sampling: SamplingConfig::Budget(BudgetConfig::default()),
            normals: NormalsConfig::default(),
            detector: DetectorConfig::Uniform(UniformConfig { leaf: Length::Resolutions(4.0) }),
            support: SupportFilter { radius: Length::Resolutions(15.0), min_points: 15 },
            descriptor: DescriptorConfig::Fpfh(FpfhConfig {
                radius: Length::Resolutions(15.0),
                variant: FpfhVariant::Open3d,
            }),
            frame: FrameConfig::Toldi(ToldiFrameConfig::default()),
            matcher: MatcherConfig::Mutual(MutualConfig::default()),
            estimator: EstimatorConfig::Pivots(PivotsConfig::default()),
            metric: MetricConfig::default(),
            pool: PoolConfig::default(),
            ranking: RankingConfig::Dense(DenseConfig::default()),
            refinement: RefinementConfig::default(),
            verdict: VerdictConfig::Dense(DenseVerdictConfig::default()),
            quick: vec![quick()],
            escalation: escalation(),
        }
    }
}

impl PipelineConfig {
    /// Returns what is wrong with the combination of settings that are valid individually, and how to fix it; `None` if
    /// they are consistent.
    #[must_use]
    pub fn contradiction(&self) -> Option<&'static str> {
        match (&self.verdict, &self.ranking) {
            (VerdictConfig::Dense(_), RankingConfig::None {}) => Some(
                "[verdict.dense] judges what [ranking.dense] measures, but [ranking.none] is configured; choose \
                 verdict=a-contrario, or ranking=dense",
            ),
            _ => None,
        }
    }
}

/// Few poses are refined: if the scans overlap well, the right one is among the first. As many poses as usual are
/// examined before refinement, so that equally good ones are not overlooked.
fn quick() -> EscalationStep {
    EscalationStep { refined: Some(10), ..EscalationStep::default() }
}

/// Few points, which average out noise; a larger radius; more points and poses; a smaller radius; another descriptor;
/// and finally the other side of uncertain normals.
fn escalation() -> Vec<EscalationStep> {
    let fpfh = |radius: f64| {
        DescriptorConfig::Fpfh(FpfhConfig { radius: Length::Resolutions(radius), variant: FpfhVariant::Open3d })
    };
    let by =
        |descriptor: DescriptorConfig| EscalationStep { descriptor: Some(descriptor), ..EscalationStep::default() };
    vec![
        EscalationStep { max_points: Some(2000), ..EscalationStep::default() },
        by(fpfh(22.0)),
        EscalationStep { max_points: Some(25_000), poses: Some(500), refined: Some(100), ..EscalationStep::default() },
        by(fpfh(10.0)),
        by(DescriptorConfig::Shot(ShotConfig::default())),
        EscalationStep { signs: Signs::Other, ..EscalationStep::default() },
    ]
}
