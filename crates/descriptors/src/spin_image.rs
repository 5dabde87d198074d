//! Spin images (Johnson and Hebert 1999; details as in PCL's rectangular form).
//!
//! A sheet of pixels rotates about a keypoint's normal and counts the points that it sweeps.

use crate::descriptor::table;
use crate::{Descriptor, Features};
use congruent_geometry::{Length, OrderedPoints, Surface, wide};
use multiversion::multiversion;
use serde::{Deserialize, Serialize};
use std::f64::consts::SQRT_2;

/// Number of pixels from the axis outwards, and from the tangent plane up and down; PCL's default.
const WIDTH: usize = 8;
/// Number of heights β along the normal: `WIDTH` below the tangent plane, as many above, and one for interpolation.
const COLUMNS: usize = 2 * WIDTH + 1;
/// Number of distances α from the axis, one row each, and one for interpolation.
const ROWS: usize = WIDTH + 1;
/// Number of cells along a radius: finer cells save distance computations, coarser ones make longer runs.
const CELLS_PER_RADIUS: f64 = 3.0;

/// `[descriptor.spin-image]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SpinImageConfig {
    /// Radius of the sphere that encloses the swept cylinder; 15 pr in Yang et al.
    pub radius: Length,
}

impl Default for SpinImageConfig {
    fn default() -> Self {
        SpinImageConfig { radius: Length::Resolutions(15.0) }
    }
}

impl SpinImageConfig {
    /// Builds the descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> SpinImage {
        SpinImage { radius: self.radius.resolve(resolution) }
    }
}

/// 9 × 17 numbers that sum to 1: rows by distance from the axis, columns by height along the normal.
///
/// Needs the keypoint's normal and one neighbour; the neighbours' normals are not read. Reversing the normal mirrors
/// the columns.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinImage {
    /// Radius of the sphere that encloses the swept cylinder, data units.
    pub radius: f64,
}

impl Descriptor for SpinImage {
    fn dim(&self) -> usize {
        ROWS * COLUMNS
    }

    fn describe_into(&self, surface: &Surface, keypoint: u32, row: &mut [f32]) -> bool {
        self.swept(surface, &self.in_order(surface), keypoint, row)
    }

    fn describe(&self, surface: &Surface, keypoints: &[u32]) -> Features {
        let ordered = self.in_order(surface);
        table(self.dim(), keypoints, |keypoint, row| self.swept(surface, &ordered, keypoint, row))
    }
}

impl SpinImage {
    fn in_order(&self, surface: &Surface) -> OrderedPoints {
        OrderedPoints::new(surface.points(), self.radius / CELLS_PER_RADIUS)
    }

    fn swept(&self, surface: &Surface, ordered: &OrderedPoints, keypoint: u32, row: &mut [f32]) -> bool {
        let (centre, normal) = (surface.points()[keypoint as usize], wide(surface.normals()[keypoint as usize]));
        let pixels_per_unit = WIDTH as f64 * SQRT_2 / self.radius;
        let sheet = Sheet { centre: wide(centre).into(), normal: normal.into(), pixels_per_unit };
        let mut image = [0.0; ROWS * COLUMNS];
        for run in ordered.cells().runs(&centre, self.radius) {
            sheet.sweep(ordered.columns().each_ref().map(|column| &column[run.clone()]), &mut image);
        }
        let total: f64 = image.iter().sum();
        row.iter_mut().zip(image).for_each(|(out, value)| *out = (value / total) as f32);
        total > 0.0 && normal.norm_squared() > 0.0
    }
}

/// Number of points processed side by side.
const LANES: usize = 16;

/// The sheet that rotates about a keypoint's normal.
struct Sheet {
    centre: [f64; 3],
    normal: [f64; 3],
    pixels_per_unit: f64,
}

impl Sheet {
    /// Distributes each point over the four pixels around it.
    fn sweep(&self, [xs, ys, zs]: [&[f32]; 3], image: &mut [f64; ROWS * COLUMNS]) {
        for ((xs, ys), zs) in xs.chunks(LANES).zip(ys.chunks(LANES)).zip(zs.chunks(LANES)) {
            let mut points = [[0.0; LANES]; 3];
            points
                .iter_mut()
                .zip([xs, ys, zs])
                .for_each(|(lanes, column)| lanes[..column.len()].copy_from_slice(column));
            let (first, shares) = places(&points, self);
            for (lane, &first) in first.iter().enumerate().take(xs.len()) {
                let first = first as usize;
                image[first] += shares[0][lane];
                image[first + 1] += shares[1][lane];
                image[first + COLUMNS] += shares[2][lane];
                image[first + COLUMNS + 1] += shares[3][lane];
            }
        }
    }
}

/// Computes, for each point, the first of its four pixels and the share of each: zero if the point is off the sheet or
/// at the keypoint. Compiled for several instruction sets and chosen at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn places([xs, ys, zs]: &[[f32; LANES]; 3], sheet: &Sheet) -> ([u32; LANES], [[f64; LANES]; 4]) {
    let (centre, normal, width) = (sheet.centre, sheet.normal, WIDTH as f64);
    let (mut first, mut shares) = ([0; LANES], [[0.0; LANES]; 4]);
    for lane in 0..LANES {
        let [x, y, z] =
            [f64::from(xs[lane]) - centre[0], f64::from(ys[lane]) - centre[1], f64::from(zs[lane]) - centre[2]];
        let away_sq = x * x + y * y + z * z;
        let height = x * normal[0] + y * normal[1] + z * normal[2];
        let across_sq = away_sq - height * height;
        let across = if across_sq > 0.0 { across_sq } else { 0.0 }.sqrt();
        let (alpha, beta) = (across * sheet.pixels_per_unit, height * sheet.pixels_per_unit);
        let counts = alpha < width && beta < width && beta > -width && away_sq > 0.0;
        let (alpha, beta) = if counts { (alpha, beta) } else { (0.0, 0.0) };
        let (row, column) = (alpha.floor(), beta.floor());
        let (right, up) = (alpha - row, beta - column);
        first[lane] = (row * COLUMNS as f64 + column + width) as i32 as u32;
        let one = if counts { 1.0 } else { 0.0 };
        shares[0][lane] = one * (1.0 - right) * (1.0 - up);
        shares[1][lane] = one * (1.0 - right) * up;
        shares[2][lane] = one * right * (1.0 - up);
        shares[3][lane] = one * right * up;
    }
    (first, shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{distance, flipped};
    use congruent_simulation::testing::{bumpy, plane, surface, turned};

    const SPIN: SpinImage = SpinImage { radius: 6.0 };

    #[test]
    fn a_plane_fills_the_middle_column_only() {
        let features = SPIN.describe(&plane(21), &[220]);
        for (i, value) in features.row(0).iter().enumerate() {
            assert!(i % COLUMNS == WIDTH || *value == 0.0);
        }
        assert!((features.row(0).iter().sum::<f32>() - 1.0).abs() < 1e-5);
    }

    /// The image about z of points at these distances from the axis and heights, in pixels.
    fn image_of(places: &[(f32, f32)]) -> [f64; ROWS * COLUMNS] {
        let sheet = Sheet { centre: [0.0; 3], normal: [0.0, 0.0, 1.0], pixels_per_unit: 1.0 };
        let (xs, zs): (Vec<f32>, Vec<f32>) = places.iter().copied().unzip();
        let mut image = [0.0; ROWS * COLUMNS];
        sheet.sweep([&xs, &vec![0.0; xs.len()], &zs], &mut image);
        image
    }

    #[test]
    fn a_point_between_pixels_is_shared() {
        let image = image_of(&[(2.25, -1.5)]);
        let at = |i: usize, j: usize| image[i * COLUMNS + j];
        assert_eq!([at(2, 6), at(2, 7), at(3, 6), at(3, 7)], [0.375, 0.375, 0.125, 0.125]);
    }

    #[test]
    fn points_off_the_sheet_and_at_the_keypoint_do_not_count() {
        let off = [(8.0, 0.0), (0.0, 8.0), (0.0, -8.0), (0.0, 0.0), (f32::MAX, 1.0)];
        assert_eq!(image_of(&off), [0.0; ROWS * COLUMNS]);
        let on = [(7.999, 7.999), (7.999, -7.999), (0.0, 0.001)];
        assert!((image_of(&on).iter().sum::<f64>() - 3.0).abs() < 1e-12);
        // More than are processed side by side.
        let many = vec![(3.5, 1.5); 3 * LANES + 1];
        assert_eq!(image_of(&many).iter().sum::<f64>(), many.len() as f64);
    }

    #[test]
    fn the_grid_finds_what_the_definition_asks_for() {
        let surface = bumpy(40, 7);
        for keypoint in [0, 333, 821] {
            let mut expected = [0.0; ROWS * COLUMNS];
            let (centre, normal) = (wide(surface.points()[keypoint]), wide(surface.normals()[keypoint]));
            for point in surface.points() {
                let offset = (wide(*point) - centre) * (WIDTH as f64 * SQRT_2 / SPIN.radius);
                let (alpha, beta) = (offset.cross(&normal).norm(), offset.dot(&normal));
                if offset.norm() > 0.0 && alpha < WIDTH as f64 && beta.abs() < WIDTH as f64 {
                    for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let share = |place: f64, next| {
                            if next == 1 { place - place.floor() } else { 1.0 - place + place.floor() }
                        };
                        let height = (beta.floor() + WIDTH as f64) as usize;
                        expected[(alpha as usize + row) * COLUMNS + height + column] +=
                            share(alpha, row) * share(beta, column);
                    }
                }
            }
            let total: f64 = expected.iter().sum();
            let features = SPIN.describe(&surface, &[keypoint as u32]);
            for (found, expected) in features.row(0).iter().zip(expected) {
                assert!((f64::from(*found) - expected / total).abs() < 1e-5);
            }
        }
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
