//! From two tables of descriptors to ranked correspondences.
//!
//! Neighbours in descriptor space are exact: a fast matrix product, or boxes around similar rows, find the candidates,
//! and every distance that decides anything is evaluated again in `f64`, so that the result does not depend on the
//! processor.

mod config;
mod correspondence;
mod leaves;
mod matchers;
mod nearest;
mod products;
mod shortlist;

pub use config::{MatcherConfig, MutualConfig, NearestConfig, RatioConfig, TopKConfig};
pub use correspondence::Correspondence;
pub use matchers::{Matcher, Mutual, Nearest, RatioRanked, TopK};
pub use nearest::{Candidate, nearest_k};
