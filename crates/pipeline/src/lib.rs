//! From two scans to one pose with a verdict: the chain of all stages.
//!
//! [`register`] makes attempts of increasing effort until one is accepted; the module `chain` is one attempt and reads
//! like the method section of the paper. [`stages`] offers each stage of an attempt separately, and [`PipelineConfig`]
//! holds all user settings for them. Nothing here opens a file or prints.

mod chain;
mod collection;
mod config;
mod details;
mod failure;
mod gauge;
mod judging;
mod memory;
mod pair;
mod preparation;
mod prepared;
mod prior;
mod ranking;
mod refine;
mod refining;
mod register;
mod registration;
mod sharpening;
mod stage;
pub mod stages;
mod trace;
mod verdict;

pub use collection::{Collection, DescribedScan, ScanSummary, Variant};
pub use config::{
    AContrarioConfig, BudgetConfig, DenseConfig, DenseVerdictConfig, EscalationStep, NeighborhoodConfig, NormalSource,
    NormalsConfig, PipelineConfig, PoolConfig, Preset, RankingConfig, SamplingConfig, Signs, Strays, VerdictConfig,
    VoxelGridConfig,
};
pub use failure::Failure;
pub use pair::Pair;
pub use preparation::count_strays;
pub use prior::{Guess, MAX_TILT, Prior, tilt};
pub use refine::{refine, refine_traced};
pub use register::{Tried, register, register_traced, register_tried, register_within};
pub use registration::{Agreement, Alternative, Counts, Estimate, Fit, Outcome, Registration, Settings, Verdict};
pub use stage::{Stage, StageTime};
pub use trace::Trace;
pub use verdict::{Calibration, MAX_RESIDUAL_PR, N_TERMS, Predictors, SLIDING_CONFIDENCE};
