//! Everything a user may say about the chain. The defaults live here, and in the families' own configs.

mod choice;
mod preparation;

pub use choice::{
    AContrarioConfig, DenseConfig, DenseVerdictConfig, EscalationStep, PoolConfig, RankingConfig, Signs, VerdictConfig,
};
pub use preparation::{
    BudgetConfig, NeighborhoodConfig, NormalSource, NormalsConfig, SamplingConfig, Strays, VoxelGridConfig,
};

use congruent_descriptors::{DescriptorConfig, FpfhConfig, FpfhVariant, FrameConfig, ShotConfig, ToldiFrameConfig};
use congruent_estimators::{EstimatorConfig, PivotsConfig};
use congruent_geometry::Length;
use congruent_keypoints::{DetectorConfig, SupportFilter, UniformConfig};
use congruent_matching::{MatcherConfig, MutualConfig};
use congruent_metrics::MetricConfig;
use congruent_refinement::RefinementConfig;
use serde::{Deserialize, Serialize};

/// The whole chain. What `pr` means is settled by `sampling`: see [`SamplingConfig`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PipelineConfig {
    /// Of all random draws.
    pub seed: u64,
    /// Thinning of the scans before anything else.
    pub sampling: SamplingConfig,
    /// Surface normals for descriptors.
    pub normals: NormalsConfig,
    /// Where to describe.
    pub detector: DetectorConfig,
    /// Which keypoints have surroundings worth describing.
    pub support: SupportFilter,
    /// How to describe.
    pub descriptor: DescriptorConfig,
    /// Local reference frames, for the estimators that need them.
    pub frame: FrameConfig,
    /// How to match.
    pub matcher: MatcherConfig,
    /// How to propose poses.
    pub estimator: EstimatorConfig,
    /// How to score them by the correspondences.
    pub metric: MetricConfig,
    /// Which of the best are kept.
    pub pool: PoolConfig,
    /// How to choose among those that are kept.
    pub ranking: RankingConfig,
    /// What is done to the chosen pose.
    pub refinement: RefinementConfig,
    /// When to believe it.
    pub verdict: VerdictConfig,
    /// What to try before, with less effort: most pairs need no more.
    pub quick: Vec<EscalationStep>,
    /// What to try, one after the other, as long as no pose is believed.
    pub escalation: Vec<EscalationStep>,
}

impl Default for PipelineConfig {
    /// The robust chain: dense keypoints, mutual matches, a compatibility graph, many poses, and a choice by how well
    /// the surfaces lie on each other.
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
    /// What is wrong with the parts together though each of them is fine by itself, and the way out.
    #[must_use]
    pub fn contradiction(&self) -> Option<&'static str> {
        match (&self.verdict, &self.ranking) {
            (VerdictConfig::Dense(_), RankingConfig::None {}) => Some(
                "[verdict.dense] judges what [ranking.dense] measures, and there is [ranking.none]; choose verdict=a-contrario, or ranking=dense",
            ),
            _ => None,
        }
    }
}

/// Few poses are refined: where the scans share much, the right one is among the first. As many as ever are looked at, so that
/// equally good ones are not overlooked.
fn quick() -> EscalationStep {
    EscalationStep { refined: Some(10), ..EscalationStep::default() }
}

/// Few points, which noise is averaged out of; other radii; more points and poses; another descriptor; and at last the other
/// side of unsure normals.
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
