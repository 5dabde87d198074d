//! What a user may say about sampling and normals.

use congruent_geometry::{Length, Orientation};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// The choice of a sampling, and with it the meaning of `pr` in all later stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SamplingConfig {
    /// Every point is used; `pr` is the mean resolution of the two scans.
    None {},
    /// One centroid for each occupied cell; `pr` is the mean resolution of the two sampled clouds.
    VoxelGrid(VoxelGridConfig),
    /// One centroid for each occupied cell, the cells enlarged until few enough points are left; `pr` is half a cell.
    Budget(BudgetConfig),
}

/// Settings of `[sampling.voxel-grid]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct VoxelGridConfig {
    /// Side of a cell; `pr` is here the resolution of the scans as they came.
    pub leaf: Length,
}

/// Settings of `[sampling.budget]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct BudgetConfig {
    /// Smallest side of a cell; `pr` is here the resolution of the scans as they came.
    pub leaf: Length,
    /// Most points that a scan may keep, on the mean of the two; at least eight.
    #[serde(deserialize_with = "most_points")]
    pub max_points: usize,
    /// What is done with points that hang alone.
    pub strays: Strays,
}

/// However large its cells are, a grid leaves a point in each of the eight corners of a scan.
const FEWEST_POINTS: usize = 8;

pub(super) fn most_points<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    match usize::deserialize(from)? {
        points @ FEWEST_POINTS.. => Ok(points),
        points => Err(D::Error::custom(format!(
            "{points} points are too few for a scan: write {FEWEST_POINTS} or more, usually thousands"
        ))),
    }
}

pub(super) fn most_points_or_none<'de, D: Deserializer<'de>>(from: D) -> Result<Option<usize>, D::Error> {
    most_points(from).map(Some)
}

/// Points that hang alone: dust, reflections, what a scanner sees along an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strays {
    /// They stay.
    Kept,
    /// They are left out where they are many: see [`without_strays`](congruent_geometry::without_strays).
    #[default]
    Dropped,
}

/// Where normals come from. Descriptors need them with the same sign convention on both scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct NormalsConfig {
    /// Estimated, or taken from the scan.
    pub source: NormalSource,
    /// What they are estimated from.
    pub neighborhood: NeighborhoodConfig,
    /// Which side is the outside.
    pub orientation: Orientation,
}

/// Where normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalSource {
    /// By principal component analysis, always.
    #[default]
    Estimated,
    /// The mesh's (from its triangles) or the file's own, where all scans that are compared have them; else estimated on all.
    Given,
}

/// The points that a normal is estimated from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NeighborhoodConfig {
    /// So many nearest points, the point itself included.
    Nearest(#[serde(deserialize_with = "congruent_geometry::numbers::at_least::<3, _, _>")] usize),
    /// All points within a length, or the six nearest where there are fewer.
    Radius(Length),
}

impl Default for VoxelGridConfig {
    fn default() -> Self {
        VoxelGridConfig { leaf: Length::Resolutions(2.0) }
    }
}

impl Default for BudgetConfig {
    fn default() -> Self {
        BudgetConfig { leaf: Length::Resolutions(2.0), max_points: 12_000, strays: Strays::Dropped }
    }
}

impl Default for NormalsConfig {
    fn default() -> Self {
        NormalsConfig {
            source: NormalSource::default(),
            neighborhood: NeighborhoodConfig::Radius(Length::Resolutions(5.0)),
            orientation: Orientation::Estimated {},
        }
    }
}
