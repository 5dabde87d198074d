//! Hypothesis metrics: how good a pose is, given the correspondences.
//!
//! A metric over correspondences is a sum of gains of residuals. The sum is one hot loop ([`Summed`]); a metric is the
//! few lines of its [`Kernel`]. A dense metric examines the two clouds instead. The formulas are those of Yang et al.,
//! *On Efficient and Robust Metrics for RANSAC Hypotheses and 3D Rigid Registration* (2020): not all inliers are equal,
//! while all outliers should be.
//!
//! ```
//! use congruent_geometry::RigidTransform;
//! use congruent_metrics::{Evidence, InlierCount, Metric, Mse, Summed};
//!
//! // Three matches that a shift by 2 along x explains, and one that it does not.
//! let from = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]];
//! let to = [[2.0, 0.0, 0.0], [12.0, 0.0, 0.0], [2.0, 10.0, 0.0], [50.0, 0.0, 0.0]];
//! let evidence = Evidence::new(from.into_iter().zip(to));
//! let (right, nearly) = (RigidTransform::translation(2.0, 0.0, 0.0), RigidTransform::translation(2.9, 0.0, 0.0));
//!
//! // The inlier count cannot tell them apart, MSE can.
//! let (count, mse) = (Summed(InlierCount::new(1.0)), Summed(Mse::new(1.0)));
//! assert_eq!(count.score(&evidence, &right), count.score(&evidence, &nearly));
//! assert!(mse.score(&evidence, &right) > mse.score(&evidence, &nearly));
//! ```

mod clouds;
mod config;
mod dense;
mod depth_image;
mod evidence;
mod kernels;
mod motion;
mod nearest_sum;
mod point_distance;
mod score;
mod summed;

pub use clouds::{Clouds, Density};
pub use config::{MetricConfig, OverlapConfig, PointDistanceConfig, QuantileConfig, ThresholdConfig};
pub use dense::{DenseAgreement, DenseRule, DenseSurface, agreement};
pub use depth_image::DepthImage;
pub use evidence::Evidence;
pub use kernels::TruncatedError;
pub use kernels::{Exp, Huber, InlierCount, Kernel, LogCosh, Mae, Magsac, Msac, Mse, Quantile, QuantileOutliers};
pub use nearest_sum::NearestSum;
pub use point_distance::{PointDistance, Reading};
pub use score::Score;
pub use summed::{Metric, Summed};
