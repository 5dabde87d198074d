//! From two scans to one pose with a verdict: the chain of all stages.
//!
//! [`register`] reads like the method section of the paper; [`PipelineConfig`] is everything a user may say about it.
//! Nothing here opens a file or prints.

mod chain;
mod config;
mod failure;
mod pair;
mod preparation;
mod ranking;
mod register;
mod registration;
mod stage;
mod verdict;

pub use config::{
    AContrarioConfig, BudgetConfig, DenseConfig, DenseVerdictConfig, EscalationStep, NeighborhoodConfig, NormalSource,
    NormalsConfig, PipelineConfig, PointToPlaneConfig, PoolConfig, RankingConfig, RefinementConfig, SamplingConfig,
    Signs, VerdictConfig, VoxelGridConfig,
};
pub use failure::Failure;
pub use pair::Pair;
pub use register::register;
pub use registration::{Agreement, Counts, Registration, Verdict};
pub use stage::{Stage, StageTime};
