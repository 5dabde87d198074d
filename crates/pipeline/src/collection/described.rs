//! A scan of a collection in a form that pairs need.

use crate::Failure;
use congruent_descriptors::Features;
use congruent_geometry::{Oriented, Surface};
use congruent_keypoints::Keypoint;
use nalgebra::Vector3;

/// The form in which a pair needs a scan; the default is that of the plain configuration, normals not turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Position among the budgets of the configuration.
    pub(super) budget: usize,
    /// Position among the descriptors of the configuration.
    pub(super) descriptor: usize,
    /// Whether the normals are turned to the other side.
    pub(super) turned: bool,
}

/// A scan, sampled, with keypoints and descriptors; or the reason why it could not be sampled.
pub struct DescribedScan {
    /// Number of points, without those that [`Scan::new`](congruent_geometry::Scan::new) dropped.
    pub(super) points: usize,
    pub(super) origin: Vector3<f64>,
    /// Longest side of the bounding box, data units.
    pub(super) extent: f64,
    pub(super) described: Result<Described, Failure>,
}

pub(super) struct Described {
    /// Number of points that were left out as strays.
    pub(super) strays: usize,
    pub(super) surface: Surface,
    pub(super) oriented: Oriented,
    pub(super) keypoints: Vec<Keypoint>,
    pub(super) features: Features,
}

impl DescribedScan {
    /// Returns the memory it occupies, bytes, accurate to a few per cent.
    #[must_use]
    pub fn bytes(&self) -> usize {
        /// Bytes for a point, its normal and its entry in the index.
        const POINT: usize = 48;
        self.described.as_ref().map_or(0, |d| {
            POINT * d.surface.len() + 4 * d.features.rows.len() + size_of::<Keypoint>() * d.keypoints.len()
        })
    }

    /// Returns the centre, which was subtracted from the file's coordinates.
    #[must_use]
    pub fn origin(&self) -> &Vector3<f64> {
        &self.origin
    }

    /// Returns the sampled points with their normals, centred; `None` if the scan could not be sampled.
    #[must_use]
    pub fn surface(&self) -> Option<&Surface> {
        Some(&self.described.as_ref().ok()?.surface)
    }

    /// Returns whether the side to which the normals point is reliable; false if the scan could not be sampled.
    #[must_use]
    pub fn side_is_sure(&self) -> bool {
        self.described.as_ref().is_ok_and(|described| described.oriented.sure)
    }

    /// Returns the mean of all descriptors, scaled to unit length: a rough summary of the shape. Empty if there are
    /// none.
    #[must_use]
    pub fn signature(&self) -> Vec<f64> {
        let Ok(Described { features, .. }) = &self.described else { return Vec::new() };
        if features.is_empty() {
            return Vec::new();
        }
        let mut mean = vec![0.0; features.dim];
        for i in 0..features.len() {
            mean.iter_mut().zip(features.row(i)).for_each(|(sum, value)| *sum += f64::from(*value));
        }
        let length = mean.iter().map(|value| value * value).sum::<f64>().sqrt();
        if length > 0.0 { mean.iter().map(|value| value / length).collect() } else { Vec::new() }
    }
}
