//! The reference frame of TOLDI (Yang, Zhang, Xiao and Cao 2017; details as in the authors' later public code).
//!
//! z is the normal of a small neighbourhood; x points to where a larger one rises from the tangent plane.

use super::{LocalFrame, Margins, ReferenceFrame, axes};
use crate::neighborhood::{Near, with_neighborhood};
use congruent_geometry::{Length, SortedEigen, Surface, sorted_eigen};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Fraction of the radius over which the normal is computed.
const NORMAL_SHARE: f64 = 1.0 / 3.0;
/// Minimum number of points for a normal, the point itself included.
const MIN_POINTS: usize = 3;
/// A sum of votes for x shorter than this, in units of radius⁵ per neighbour, comes from a flat patch.
const FLAT: f64 = 1e-9;

/// `[frame.toldi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct ToldiFrameConfig {
    /// Radius of the neighbourhood; 15 pr as for the descriptors of Yang et al.
    pub radius: Length,
}

impl Default for ToldiFrameConfig {
    fn default() -> Self {
        ToldiFrameConfig { radius: Length::Resolutions(15.0) }
    }
}

impl ToldiFrameConfig {
    /// Builds the frame for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> ToldiFrame {
        ToldiFrame { radius: self.radius.resolve(resolution) }
    }
}

/// Axes from the normal (z, away from the neighbours' side) and the neighbours' heights above the tangent plane (x).
///
/// There is no frame for a flat patch. Reads no normals. y is `z × x`; the authors use `x × z`.
#[derive(Clone, Debug, PartialEq)]
pub struct ToldiFrame {
    /// Radius of the neighbourhood, data units.
    pub radius: f64,
}

impl ReferenceFrame for ToldiFrame {
    fn frame(&self, surface: &Surface, keypoint: u32) -> Option<LocalFrame> {
        with_neighborhood(surface, keypoint, self.radius, |neighbors| toldi_frame(neighbors, self.radius))
    }
}

fn toldi_frame(neighbors: &[Near], radius: f64) -> Option<LocalFrame> {
    let small: Vec<&Near> = neighbors.iter().filter(|near| near.distance <= NORMAL_SHARE * radius).collect();
    if small.len() + 1 < MIN_POINTS {
        return None;
    }
    let eigen = spread(&small);
    let [smallest, middle, largest] = eigen.values;
    let (z, z_sign) = away_from(&eigen.vectors[0], &small);
    let (sum, total) = votes(&z, neighbors, radius);
    let length = sum.norm();
    if length.is_nan() || length < FLAT * radius.powi(5) * neighbors.len() as f64 {
        return None;
    }
    let agreement = (length / total).min(1.0);
    let margins =
        Margins { z: ((middle - smallest) / largest).clamp(0.0, 1.0), x: agreement, z_sign, x_sign: agreement };
    // Each vote is perpendicular to z up to rounding; made exact here, so that the axes stay a rotation.
    let x = (sum - z * z.dot(&sum)).normalize();
    Some(LocalFrame { axes: axes(&x, &z), margins })
}

/// Decomposes the covariance of the neighbours and the point itself, about their centroid.
fn spread(small: &[&Near]) -> SortedEigen {
    let count = (small.len() + 1) as f64;
    let mean: Vector3<f64> = small.iter().map(|near| near.offset).sum::<Vector3<f64>>() / count;
    let squares: Matrix3<f64> = small.iter().map(|near| near.offset * near.offset.transpose()).sum();
    sorted_eigen(&(squares / count - mean * mean.transpose()))
}

/// Returns the axis with the sign for which Σ z·(p − p_j) ≥ 0, and how far the terms agree.
fn away_from(axis: &Vector3<f64>, small: &[&Near]) -> (Vector3<f64>, f64) {
    let (mut sum, mut total) = (0.0, 0.0);
    for near in small {
        let depth = -axis.dot(&near.offset);
        sum += depth;
        total += depth.abs();
    }
    let margin = if total > 0.0 { (sum.abs() / total).min(1.0) } else { 0.0 };
    (if sum >= 0.0 { *axis } else { -axis }, margin)
}

/// Returns Σ (R − d)² h|h| (v − h z) over the neighbours v at height h = z·v, and the sum of the terms' lengths. The
/// paper squares h; the signed square in the authors' code distinguishes hills from hollows.
fn votes(z: &Vector3<f64>, neighbors: &[Near], radius: f64) -> (Vector3<f64>, f64) {
    let (mut sum, mut total) = (Vector3::zeros(), 0.0);
    for near in neighbors {
        let height = z.dot(&near.offset);
        let weight = (radius - near.distance).powi(2) * height * height.abs();
        let vote = (near.offset - z * height) * weight;
        sum += vote;
        total += vote.norm();
    }
    (sum, total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_simulation::testing::height_field;

    /// A dome that falls steeply on one side.
    fn frame() -> LocalFrame {
        let dome = height_field(21, |x, y| -0.02 * (x * x + y * y) - if x > 3.0 { 0.3 * (x - 3.0) } else { 0.0 });
        ToldiFrame { radius: 9.0 }.frame(&dome, 220).unwrap()
    }

    #[test]
    fn z_points_away_from_the_neighbors() {
        let frame = frame();
        assert!(frame.axes[(2, 2)] > 0.99 && frame.margins.z_sign > 0.5, "{frame:?}");
    }

    #[test]
    fn x_points_away_from_the_deepest_side() {
        let frame = frame();
        assert!(frame.axes[(0, 0)] < -0.99 && frame.margins.x > 0.1, "{frame:?}");
    }
}
