//! User settings for sampling and normals.

use congruent_geometry::{Length, Orientation};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// The choice of a sampling, which also determines the meaning of `pr` in all later stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SamplingConfig {
    /// Every point is used; `pr` is the mean resolution of the two scans.
    None {},
    /// One centroid for each occupied cell; `pr` is the mean resolution of the two sampled clouds.
    VoxelGrid(VoxelGridConfig),
    /// One centroid for each occupied cell; cells are enlarged until few enough points remain. `pr` is half the side of
    /// a cell.
    Budget(BudgetConfig),
}

/// Settings of `[sampling.voxel-grid]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct VoxelGridConfig {
    /// Side of a cell; here `pr` is the mean resolution of the scans as provided.
    pub leaf: Length,
}

/// Settings of `[sampling.budget]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct BudgetConfig {
    /// Minimum side of a cell; here `pr` is the mean resolution of the scans as provided.
    pub leaf: Length,
    /// Maximum number of points that remain, as a mean over the two scans; at least eight.
    #[serde(deserialize_with = "most_points")]
    pub max_points: usize,
    /// How isolated and distant points are treated.
    pub strays: Strays,
}

/// However large the cells are, up to eight points remain: the centre of a scan is a corner of eight cells.
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

/// How strays are treated: isolated points from dust, reflections, and what a scanner sees along an edge; and points far
/// from the scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strays {
    /// They are kept.
    Kept,
    /// Isolated ones are removed if there are many, distant ones if there are few: see [`without_strays`](congruent_geometry::without_strays).
    #[default]
    Dropped,
}

/// How normals are obtained. Descriptors need the same sign convention on both scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct NormalsConfig {
    /// Whether they are estimated or taken from the scan.
    pub source: NormalSource,
    /// The points from which they are estimated.
    pub neighborhood: NeighborhoodConfig,
    /// Which side they point to.
    pub orientation: Orientation,
}

/// The origin of the normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalSource {
    /// Always estimated, by principal component analysis.
    #[default]
    Estimated,
    /// Those of the mesh (from its triangles) or of the file if all scans compared have them; otherwise all are
    /// estimated. Zero normals are replaced by estimated ones.
    Given,
}

/// The points from which a normal is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NeighborhoodConfig {
    /// This many nearest points, the point itself included.
    Nearest(#[serde(deserialize_with = "congruent_geometry::numbers::at_least::<3, _, _>")] usize),
    /// All points within this distance, or the six nearest if there are fewer.
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
