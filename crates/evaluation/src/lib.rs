//! How good an answer is: errors against ground truth, statistics over many pairs, and the experiments of the paper.
//!
//! [`GroundTruth`] measures the errors of poses of one pair, [`PairRow`] is what a batch records about it, and
//! [`Summary`] is the table over many rows. [`experiment`] scores many metrics and thresholds on the same stream of
//! hypotheses. Definitions are those of Yang et al., *On Efficient and Robust Metrics for RANSAC Hypotheses and 3D
//! Rigid Registration* (2020); where the paper leaves something open, the documentation of the item concerned says how
//! it was settled. Nothing here opens a file or prints.

pub mod calibration;
pub mod experiment;
mod matches;
mod row;
pub mod statistics;
mod summary;
mod truth;

pub use matches::{InlierShare, inlier_share, repeatability};
pub use row::{PairRow, Status};
pub use summary::{BANDS, D_RMSE, Summary, VERDICT_D_RMSE, mcnemar_of};
pub use truth::{GroundTruth, MIN_SHARED, PoseErrors, SHARED_WITHIN_PR};
