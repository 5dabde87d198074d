//! The reference frame of SHOT (Tombari, Salti and Di Stefano 2010; details as in PCL).
//!
//! The axes are those of the neighbours' scatter, in which nearer ones weigh more; the majority decides their signs.

use super::{LocalFrame, Margins, ReferenceFrame, axes};
use crate::neighborhood::{Near, with_neighborhood};
use congruent_geometry::{Length, Surface, sorted_eigen};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Minimum number of neighbours, the point itself not counted; PCL's bound.
const MIN_NEIGHBORS: usize = 5;
/// Number of neighbours of median distance that decide a sign that the majority leaves open; PCL's number.
const TIE_VOTERS: usize = 5;

/// `[frame.shot]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct ShotFrameConfig {
    /// Radius of the neighbourhood; 15 pr as for the descriptors of Yang et al.
    pub radius: Length,
}

impl Default for ShotFrameConfig {
    fn default() -> Self {
        ShotFrameConfig { radius: Length::Resolutions(15.0) }
    }
}

impl ShotFrameConfig {
    /// Builds the frame for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> ShotFrame {
        ShotFrame { radius: self.radius.resolve(resolution) }
    }
}

/// Axes of least (z) and largest (x) scatter about the point. Needs five neighbours; reads no normals.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotFrame {
    /// Radius of the neighbourhood, data units.
    pub radius: f64,
}

impl ReferenceFrame for ShotFrame {
    fn frame(&self, surface: &Surface, keypoint: u32) -> Option<LocalFrame> {
        with_neighborhood(surface, keypoint, self.radius, |neighbors| shot_frame(neighbors, self.radius))
    }
}

/// Computes the frame from neighbours that were already found within `radius`.
pub(crate) fn shot_frame(neighbors: &[Near], radius: f64) -> Option<LocalFrame> {
    if neighbors.len() < MIN_NEIGHBORS {
        return None;
    }
    let eigen = sorted_eigen(&weighted_scatter(neighbors, radius)?);
    let [smallest, middle, largest] = eigen.values;
    if largest.is_nan() || largest <= 0.0 {
        return None;
    }
    let (z, z_sign) = with_majority(&eigen.vectors[0], neighbors);
    let (x, x_sign) = with_majority(&eigen.vectors[2], neighbors);
    let share = |difference: f64| (difference / largest).clamp(0.0, 1.0);
    let margins = Margins { z: share(middle - smallest), x: share(largest - middle), z_sign, x_sign };
    Some(LocalFrame { axes: axes(&x, &z), margins })
}

/// Returns the scatter about the point, each neighbour weighted by its distance from the rim; `None` if all are on the
/// rim.
fn weighted_scatter(neighbors: &[Near], radius: f64) -> Option<Matrix3<f64>> {
    let (mut scatter, mut total) = (Matrix3::zeros(), 0.0);
    for near in neighbors {
        let weight = (radius - near.distance).max(0.0);
        let weighted = near.offset * weight;
        scatter += weighted * near.offset.transpose();
        total += weight;
    }
    (total > 0.0).then(|| scatter / total)
}

/// Returns the axis with the sign of the side on which most neighbours lie, and their margin as a fraction of all
/// neighbours. Neighbours exactly perpendicular to it count as positive for the sign, as in PCL, and for neither side
/// in the margin.
fn with_majority(axis: &Vector3<f64>, neighbors: &[Near]) -> (Vector3<f64>, f64) {
    let (mut ahead, mut behind) = (0usize, 0usize);
    for near in neighbors {
        let along = near.offset.dot(axis);
        ahead += usize::from(along > 0.0);
        behind += usize::from(along < 0.0);
    }
    let margin = ahead.abs_diff(behind) as f64 / neighbors.len() as f64;
    let not_behind = neighbors.len() - behind;
    let keep = if not_behind == behind { middle_votes_for(axis, neighbors) } else { not_behind > behind };
    (if keep { *axis } else { -axis }, margin)
}

/// Returns whether most of the neighbours of median distance lie ahead.
fn middle_votes_for(axis: &Vector3<f64>, neighbors: &[Near]) -> bool {
    let mut sorted: Vec<&Near> = neighbors.iter().collect();
    sorted.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
    let first = sorted.len() / 2 - TIE_VOTERS / 2;
    let votes = sorted[first..first + TIE_VOTERS].iter().filter(|near| near.offset.dot(axis) > 0.0).count();
    votes > TIE_VOTERS / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(offsets: &[[f64; 3]]) -> Vec<Near> {
        let near = |(index, &offset): (usize, &[f64; 3])| {
            let offset = Vector3::from(offset);
            Near { index: index as u32, distance: offset.norm(), offset }
        };
        offsets.iter().enumerate().map(near).collect()
    }

    #[test]
    fn the_axes_are_those_of_scatter_towards_the_majority() {
        let neighbors = near(&[
            [3.0, 0.0, -0.1],
            [2.0, 0.0, -0.1],
            [1.0, 0.0, -0.1],
            [-3.0, 0.0, 0.1],
            [0.0, 1.0, -0.1],
            [0.1, -1.0, -0.1],
        ]);
        let frame = shot_frame(&neighbors, 4.0).unwrap();
        assert!(frame.axes[(0, 0)] > 0.99 && frame.axes[(2, 2)] < -0.99);
        assert!((frame.margins.z_sign - 4.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn the_middle_decides_where_the_sides_are_even() {
        let mut offsets =
            [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [-0.5, 0.0, 0.0], [-0.6, 0.0, 0.0], [-9.0, 0.0, 0.0]];
        // By distance: − − + + + −; the middle five are the last five.
        assert_eq!(with_majority(&Vector3::x(), &near(&offsets)), (Vector3::x(), 0.0));
        offsets.iter_mut().for_each(|o| o[0] = -o[0]);
        assert_eq!(with_majority(&Vector3::x(), &near(&offsets)), (-Vector3::x(), 0.0));
    }

    #[test]
    fn five_neighbors_are_needed() {
        let offsets = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [-1.0, 0.2, 0.0], [0.0, -1.0, 0.3], [0.5, 0.5, 0.5]];
        assert!(shot_frame(&near(&offsets), 2.0).is_some());
        assert!(shot_frame(&near(&offsets[..4]), 2.0).is_none());
    }
}
