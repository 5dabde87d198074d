//! The experiments of the paper: many metrics, thresholds and budgets on the same hypotheses.
//!
//! For each pair the chain runs once up to the matches; each estimator then proposes one stream of poses, and every
//! metric at every threshold ranks all of it. So differences between metrics are due to the metrics alone, and paired
//! tests are valid. The answer is the paper's: the best hypothesis as it was drawn, without any refinement. Several
//! experiments on one pair share all results that they have in common.

mod bench;
mod cell;
pub mod claims;
mod groups;
mod histogram;
mod labels;
mod nuisance;
mod plan;
mod run;
mod tables;
mod tally;

pub use bench::SETTINGS_READ;
pub use cell::{Cell, Measured};
pub use groups::{distinct, groups};
pub use nuisance::Nuisance;
pub use plan::{Axis, MeasuredOn, Plan, Shows, Variant};
pub use run::{Problem, Request, run_pair};
pub use tally::{Count, Tally};
