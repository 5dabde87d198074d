//! Hypothesis metrics: how good is a pose, given the correspondences.
//!
//! A metric over correspondences is a sum of gains of residuals. The sum is one hot loop ([`Summed`]); a metric is the
//! few lines of its [`Kernel`]. A dense metric looks at the two clouds instead. The formulas are those of Yang et al., *On Efficient and Robust Metrics for RANSAC
//! Hypotheses and 3D Rigid Registration* (2020): not all inliers are equal, while all outliers should be.

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
