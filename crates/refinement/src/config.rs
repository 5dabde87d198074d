//! User settings for the final refinement.

use crate::{Freedom, Gicp, NoRefinement, PointToPlane, Refiner, Schedule};
use congruent_geometry::Length;
use serde::{Deserialize, Serialize};

/// A step shorter than this many `pr` ends a refinement.
const TOLERANCE_PR: f64 = 0.002;

/// The refinement of the chosen pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefinementConfig {
    /// Nothing.
    None {},
    /// Point-to-plane ICP.
    PointToPlane(PointToPlaneConfig),
    /// Generalized ICP.
    Gicp(GicpConfig),
}

/// Settings of `[refinement.point-to-plane]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PointToPlaneConfig {
    /// Distance above which pairs are ignored at first …
    pub start_radius: Length,
    /// … and at the end.
    pub end_radius: Length,
    /// Distance to the tangent plane at which the weight of a pair is one half.
    pub scale: Length,
    /// Maximum number of rounds.
    pub rounds: usize,
    /// Maximum number of source points used in a round.
    pub points: usize,
    /// Minimum agreement of the normals (cosine).
    #[serde(deserialize_with = "congruent_geometry::numbers::cosine")]
    pub min_normal_cosine: f64,
}

/// Settings of `[refinement.gicp]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct GicpConfig {
    /// Distance above which pairs are ignored at first …
    pub start_radius: Length,
    /// … and at the end.
    pub end_radius: Length,
    /// Distance to the tangent plane at which the weight of a pair is one half.
    pub scale: Length,
    /// Maximum number of rounds.
    pub rounds: usize,
    /// Maximum number of source points used in a round.
    pub points: usize,
    /// Minimum agreement of the normals (cosine).
    #[serde(deserialize_with = "congruent_geometry::numbers::cosine")]
    pub min_normal_cosine: f64,
    /// Variance of a point along its normal, relative to a variance of one along the surface.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub flatness: f64,
}

impl RefinementConfig {
    /// Builds the refiner, restricted to the allowed motions; `resolution` is the meaning of `pr` in data units.
    #[must_use]
    pub fn build(&self, resolution: f64, freedom: Freedom) -> Box<dyn Refiner> {
        match self {
            RefinementConfig::None {} => Box::new(NoRefinement),
            RefinementConfig::PointToPlane(config) => Box::new(config.build(resolution).within(freedom)),
            RefinementConfig::Gicp(config) => Box::new(config.build(resolution).within(freedom)),
        }
    }
}

impl Default for RefinementConfig {
    fn default() -> Self {
        RefinementConfig::PointToPlane(PointToPlaneConfig::default())
    }
}

impl Default for PointToPlaneConfig {
    fn default() -> Self {
        PointToPlaneConfig {
            start_radius: Length::Resolutions(3.0),
            end_radius: Length::Resolutions(1.5),
            scale: Length::Resolutions(0.75),
            rounds: 20,
            points: 15_000,
            min_normal_cosine: 0.5,
        }
    }
}

impl Default for GicpConfig {
    fn default() -> Self {
        let PointToPlaneConfig { start_radius, end_radius, scale, rounds, points, min_normal_cosine } =
            PointToPlaneConfig::default();
        GicpConfig { start_radius, end_radius, scale, rounds, points, min_normal_cosine, flatness: 1e-3 }
    }
}

impl PointToPlaneConfig {
    /// Builds the refiner, with lengths in data units.
    #[must_use]
    pub fn build(&self, resolution: f64) -> PointToPlane {
        let length = |length: Length| length.resolve(resolution);
        PointToPlane {
            schedule: Schedule {
                start_radius: length(self.start_radius),
                end_radius: length(self.end_radius),
                scale: length(self.scale),
                rounds: self.rounds,
                max_points: self.points,
                min_normal_cosine: self.min_normal_cosine,
                tolerance: TOLERANCE_PR * resolution,
                freedom: Freedom::All,
            },
        }
    }
}

impl GicpConfig {
    /// Builds the refiner, with lengths in data units.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Gicp {
        let GicpConfig { start_radius, end_radius, scale, rounds, points, min_normal_cosine, flatness } = *self;
        let common = PointToPlaneConfig { start_radius, end_radius, scale, rounds, points, min_normal_cosine };
        Gicp { schedule: common.build(resolution).schedule, flatness }
    }
}
