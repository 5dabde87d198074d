//! Hypothesis generators and the one loop that samples, scores and ranks.

mod config;
mod graph;
mod local_optimisation;
mod pivots;
mod pool;
mod sampling;
mod three_point;

pub use config::{EstimatorConfig, PivotsConfig, RansacConfig};
pub use graph::{Compatibility, Graph};
pub use local_optimisation::optimise;
pub use pivots::Pivots;
pub use pool::Distinctness;
pub use sampling::{Hypothesis, HypothesisGenerator, sample};
pub use three_point::ThreePoint;
