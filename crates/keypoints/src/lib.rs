//! Keypoint detectors: which points of a surface are worth describing.
//!
//! A [`Detector`] picks points of a [`Surface`](congruent_geometry::Surface); a [`DetectorConfig`] is a user's choice
//! of one. [`supported`] then drops keypoints that have too little surface around them to be described.

mod boundary;
mod config;
mod corner;
mod detector;
mod harris;
mod iss;
mod maxima;
mod support;
#[cfg(test)]
mod testing;
mod uniform;

pub use config::DetectorConfig;
pub use detector::{Detector, Keypoint};
pub use harris::{Harris, HarrisConfig, HarrisResponse, Placement};
pub use iss::{Iss, IssConfig, IssVariant};
pub use maxima::{Ties, local_maxima};
pub use support::{SupportFilter, supported};
pub use uniform::{Uniform, UniformConfig};
