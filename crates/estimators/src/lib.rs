//! Hypothesis generators and the one loop that samples, scores and ranks.
//!
//! ```
//! use congruent_estimators::{ThreePoint, sample};
//! use congruent_metrics::{Evidence, Mse, Summed};
//! use congruent_simulation::correspondences::{CorrespondenceScene, NearMiss};
//!
//! // A fifth of these pairs is right; their true pose is known.
//! let scene = CorrespondenceScene { n: 500, inlier_share: 0.2, near_miss_share: 0.0, near_miss: NearMiss::Random };
//! let pairs = scene.generate(7);
//! let evidence = Evidence::new(pairs.source.iter().copied().zip(pairs.target.iter().copied()));
//! let best = &sample(&ThreePoint::new(&evidence, 2000, 7), &Summed(Mse::new(7.5)), &evidence, 1)[0];
//! assert!(best.target_from_source.rotation.angle_to(&pairs.truth.rotation) < 0.05);
//! ```

mod adaptive_stop;
mod cliques;
mod commons;
mod config;
mod draws;
mod framed;
mod graph;
mod local_optimisation;
mod one_point;
mod pivots;
mod pool;
mod prosac;
mod pruning;
mod sac_ia;
mod sampling;
mod seeds;
mod thinning;
mod three_point;
mod two_point;

pub use adaptive_stop::AdaptiveStop;
pub use cliques::Cliques;
pub use config::EstimatorConfig;
pub use config::{
    AdaptiveStopConfig, AngleTest, CliquesConfig, GraphConfig, OnePointConfig, PivotsConfig, RansacConfig, SacIaConfig,
    SeedsConfig, TwoPointConfig,
};
pub use graph::{Compatibility, Graph};
pub use local_optimisation::optimise_all;
pub use one_point::OnePoint;
pub use pivots::Pivots;
pub use pool::Distinctness;
pub use prosac::Order;
pub use pruning::Pruning;
pub use sac_ia::SacIa;
pub use sampling::{Drawn, Hypothesis, HypothesisGenerator, sample, sample_all};
pub use seeds::{SeedRule, Seeds};
pub use three_point::{ThreePoint, TripleRule};
pub use two_point::{PairRule, TwoPoint};
