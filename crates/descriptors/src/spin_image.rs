//! Spin images (Johnson and Hebert 1999; details as in PCL's rectangular form).
//!
//! A sheet of pixels turns about a keypoint's normal and counts the points that it sweeps.

use crate::Descriptor;
use congruent_geometry::{Length, Surface, wide};
use serde::{Deserialize, Serialize};
use std::f64::consts::SQRT_2;

/// Pixels from the axis outwards, and from the tangent plane up and down; PCL's default.
const WIDTH: usize = 8;
/// Heights β along the normal: `WIDTH` below the tangent plane, as many above, and one for interpolation.
const COLUMNS: usize = 2 * WIDTH + 1;
/// Distances α from the axis, one row each, and one for interpolation.
const ROWS: usize = WIDTH + 1;

/// `[descriptor.spin-image]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SpinImageConfig {
    /// Radius of the sphere in which the swept cylinder fits; 15 pr in Yang et al.
    pub radius: Length,
}

impl Default for SpinImageConfig {
    fn default() -> Self {
        SpinImageConfig { radius: Length::Resolutions(15.0) }
    }
}

impl SpinImageConfig {
    /// The descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> SpinImage {
        SpinImage { radius: self.radius.resolve(resolution) }
    }
}

/// 9 × 17 numbers that sum to 1: rows by distance from the axis, columns by height along the normal.
///
/// Needs the keypoint's normal and one neighbour; the neighbours' normals are not read. Turning the normal round mirrors
/// the columns.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinImage {
    /// Of the sphere in which the swept cylinder fits, data units.
    pub radius: f64,
}

impl Descriptor for SpinImage {
    fn dim(&self) -> usize {
        ROWS * COLUMNS
    }

    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool {
        let normal = wide(surface.normals()[keypoint as usize]);
        let centre = surface.points()[keypoint as usize];
        let pixel = self.radius / (WIDTH as f64 * SQRT_2);
        let mut image = [0.0; ROWS * COLUMNS];
        surface.index().within(&centre, self.radius, |n| {
            let offset = wide(surface.points()[n.index as usize]) - wide(centre);
            let beta = offset.dot(&normal);
            let alpha = (offset.norm_squared() - beta * beta).max(0.0).sqrt();
            if offset.norm_squared() > 0.0 {
                deposit(alpha / pixel, beta / pixel, &mut image);
            }
        });
        let total: f64 = image.iter().sum();
        row.iter_mut().zip(image).for_each(|(out, value)| *out = (value / total) as f32);
        total > 0.0 && normal.norm_squared() > 0.0
    }
}

/// Shares a point between the four pixels around it; `alpha` and `beta` in pixels. Nothing where it is off the sheet.
fn deposit(alpha: f64, beta: f64, image: &mut [f64; ROWS * COLUMNS]) {
    let width = WIDTH as f64;
    if alpha >= width || beta.abs() >= width {
        return;
    }
    let (right, up) = (alpha.fract(), beta - beta.floor());
    let first = alpha as usize * COLUMNS + (beta.floor() + width) as usize;
    image[first] += (1.0 - right) * (1.0 - up);
    image[first + 1] += (1.0 - right) * up;
    image[first + COLUMNS] += right * (1.0 - up);
    image[first + COLUMNS + 1] += right * up;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{bumpy, distance, flipped, plane, surface, turned};

    const SPIN: SpinImage = SpinImage { radius: 6.0 };

    #[test]
    fn a_plane_fills_the_middle_column_only() {
        let features = SPIN.describe(&plane(21), &[220]);
        for (i, value) in features.row(0).iter().enumerate() {
            assert!(i % COLUMNS == WIDTH || *value == 0.0);
        }
        assert!((features.row(0).iter().sum::<f32>() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_point_between_pixels_is_shared() {
        let mut image = [0.0; ROWS * COLUMNS];
        deposit(2.25, -1.5, &mut image);
        let at = |i: usize, j: usize| image[i * COLUMNS + j];
        assert_eq!([at(2, 6), at(2, 7), at(3, 6), at(3, 7)], [0.375, 0.375, 0.125, 0.125]);
    }

    #[test]
    fn points_off_the_sheet_do_not_count() {
        let mut image = [0.0; ROWS * COLUMNS];
        for (alpha, beta) in [(8.0, 0.0), (0.0, 8.0), (0.0, -8.0)] {
            deposit(alpha, beta, &mut image);
        }
        assert_eq!(image.iter().sum::<f64>(), 0.0);
        for (alpha, beta) in [(7.999, 7.999), (7.999, -7.999), (0.0, 0.0)] {
            deposit(alpha, beta, &mut image);
        }
        assert!((image.iter().sum::<f64>() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn turning_the_normal_round_mirrors_the_columns() {
        let surface = bumpy(30, 2);
        let (up, down) = (SPIN.describe(&surface, &[465]), SPIN.describe(&flipped(&surface), &[465]));
        for i in 0..ROWS {
            for j in 0..COLUMNS {
                let (a, b) = (up.row(0)[i * COLUMNS + j], down.row(0)[(i + 1) * COLUMNS - 1 - j]);
                assert!((a - b).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_turned_surface_is_described_alike() {
        let before = bumpy(30, 5);
        let all: Vec<u32> = (0..before.len() as u32).collect();
        let (a, b) = (SPIN.describe(&before, &all), SPIN.describe(&turned(&before, 6), &all));
        assert!(a.keypoints == all && b.keypoints == all);
        let same = (0..a.len()).filter(|&i| distance(a.row(i), b.row(i)) < 1e-4).count();
        assert!(same as f64 >= 0.99 * a.len() as f64, "{same} of {}", a.len());
    }

    #[test]
    fn a_point_with_a_normal_but_no_neighbor_has_none() {
        let far = surface(vec![[0.0; 3], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0], [100.0, 100.0, 1.0]]);
        assert!(SPIN.describe(&far, &[0, 1, 2, 3]).is_empty());
    }
}
