//! A range scanner that looks at a mesh: one ray for each pixel returns the nearest surface.
//!
//! Sensor frame: origin at the sensor, x to the right, y down, z along the view. Shells are seen from both sides.

mod pose;
mod range_scan;
mod raster;

pub use pose::look_at;
pub use range_scan::RangeScan;

use crate::Mesh;
use congruent_geometry::RigidTransform;
use congruent_geometry::random::Stream;
use nalgebra::{Point3, Vector3};
use raster::{Hit, Pinhole};
use rayon::prelude::*;

/// Errors of the measured range, along the ray. The default has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RangeNoise {
    /// Standard deviation next to the sensor, data units.
    pub sigma: f64,
    /// Increase of the standard deviation with the square of the range, per data unit, as in triangulating sensors.
    pub growth: f64,
    /// Ranges are rounded to a multiple of this, data units, after the noise; zero for no rounding.
    pub step: f64,
}

impl RangeNoise {
    /// Returns Gaussian noise with one standard deviation (data units) at every range.
    #[must_use]
    pub fn gaussian(sigma: f64) -> Self {
        RangeNoise { sigma, ..RangeNoise::default() }
    }

    fn measured(&self, range: f64, stream: &mut Stream) -> f64 {
        let noisy = range + (self.sigma + self.growth * range * range) * stream.normal();
        if self.step > 0.0 { (noisy / self.step).round() * self.step } else { noisy }
    }
}

/// A pinhole range camera with square pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualScanner {
    /// Position and orientation of the sensor.
    pub world_from_sensor: RigidTransform,
    /// Number of pixels across.
    pub width: u32,
    /// Number of pixels down.
    pub height: u32,
    /// Angle between the left and the right edge of the image, radians, between 0 and π.
    pub horizontal_view: f64,
    /// Errors of the ranges.
    pub noise: RangeNoise,
    /// Maximum angle between the ray and the surface normal, radians; returns beyond it are lost, but the surface still
    /// hides what is behind it.
    pub max_incidence: f64,
}

impl VirtualScanner {
    /// Scans a mesh given in world coordinates. There are no points for an image or a view angle without rays.
    ///
    /// # Panics
    /// If a triangle refers to a point outside of the mesh's points.
    #[must_use]
    pub fn scan(&self, mesh: &Mesh, seed: u64) -> RangeScan {
        let mut scan = RangeScan {
            points: Vec::new(),
            pixels: Vec::new(),
            width: self.width,
            height: self.height,
            world_from_sensor: self.world_from_sensor,
        };
        let Some(camera) = Pinhole::new(self.width, self.height, self.horizontal_view) else { return scan };
        let sensor_from_world = self.world_from_sensor.inverse();
        let points: Vec<Vector3<f64>> =
            mesh.points.par_iter().map(|&p| (sensor_from_world * Point3::from(p)).coords).collect();
        let hits = raster::nearest_hits(&camera, &points, &mesh.triangles);
        let returns: Vec<(u32, [f64; 3])> = (0..hits.len() as u32)
            .into_par_iter()
            .filter_map(|pixel| Some((pixel, self.measured(&camera, &hits[pixel as usize], pixel, seed)?)))
            .collect();
        (scan.pixels, scan.points) = returns.into_iter().unzip();
        scan
    }

    /// Returns the point that a pixel measures, if any.
    fn measured(&self, camera: &Pinhole, hit: &Hit, pixel: u32, seed: u64) -> Option<[f64; 3]> {
        let ray = camera.ray(pixel % self.width, pixel / self.width);
        let cos_incidence = hit.normal.dot(&ray).abs() / (hit.normal.norm() * ray.norm());
        if !hit.depth.is_finite() || cos_incidence < self.max_incidence.cos() {
            return None;
        }
        let range = hit.depth * ray.norm();
        let measured = self.noise.measured(range, &mut Stream::new(seed, u64::from(pixel)));
        (measured > 0.0).then(|| (ray * (hit.depth * (measured / range))).into())
    }

    /// Returns the distance between the points of neighbouring pixels on a surface that faces the sensor at a depth
    /// (data units); NaN or zero if there are no rays.
    #[must_use]
    pub fn spacing_at(&self, depth: f64) -> f64 {
        2.0 * depth * (self.horizontal_view / 2.0).tan() / f64::from(self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{ROOM_SIZE, plane, room, sphere};

    fn at_origin(width: u32, height: u32) -> VirtualScanner {
        VirtualScanner {
            world_from_sensor: RigidTransform::identity(),
            width,
            height,
            horizontal_view: 1.0,
            noise: RangeNoise::default(),
            max_incidence: 80f64.to_radians(),
        }
    }

    fn raised(mut mesh: Mesh, z: f64) -> Mesh {
        mesh.points.iter_mut().for_each(|p| p[2] += z);
        mesh
    }

    #[test]
    fn a_plane_has_one_depth_in_every_pixel() {
        let scan = at_origin(40, 30).scan(&raised(plane(100.0, 7), 5.0), 1);
        assert_eq!(scan.points.len(), 40 * 30);
        assert!(scan.points.iter().all(|p| (p[2] - 5.0).abs() < 1e-12));
        // Pixel 0 is at the upper left: x to the right and y down are negative there.
        assert!(scan.points[0][0] < 0.0 && scan.points[0][1] < 0.0);
        let spacing = scan.points[1][0] - scan.points[0][0];
        assert!((spacing - at_origin(40, 30).spacing_at(5.0)).abs() < 1e-12);
        let half_width = spacing * 20.0;
        assert!(((half_width / 5.0).atan() * 2.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_nearest_of_two_surfaces_wins() {
        let (near, far) = (raised(plane(1.0, 1), 3.0), raised(plane(100.0, 1), 6.0));
        for parts in [[&near, &far], [&far, &near]] {
            let mut both = parts[0].clone();
            both.append(parts[1]);
            let scan = at_origin(50, 50).scan(&both, 0);
            assert_eq!(scan.points.len(), 2500);
            for p in &scan.points {
                // A ray ends on the near square exactly if it passes through it.
                let through = p[0].abs().max(p[1].abs()) * 3.0 / p[2] <= 0.5;
                assert!((p[2] - if through { 3.0 } else { 6.0 }).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn only_the_visible_cap_of_a_sphere_is_seen() {
        let mut scanner = at_origin(120, 120);
        scanner.max_incidence = 60f64.to_radians();
        let scan = scanner.scan(&raised(sphere(2.0, 6), 6.0), 0);
        let centre = Vector3::new(0.0, 0.0, 6.0);
        assert!(scan.points.len() > 2000);
        for p in &scan.points {
            let p = Vector3::from(*p);
            let outward = (p - centre) / 2.0;
            // Facets of the sixth subdivision are at most 3e-4 of the radius below the sphere, and tilted by 1.5°.
            assert!((outward.norm() - 1.0).abs() < 3e-4);
            assert!(outward.angle(&-p) < 61.5f64.to_radians());
        }
    }

    #[test]
    fn noise_lies_along_the_ray_and_has_its_deviation() {
        let mut scanner = at_origin(100, 100);
        let wall = raised(plane(100.0, 1), 10.0);
        let clean = scanner.scan(&wall, 7);
        scanner.noise = RangeNoise { sigma: 0.02, growth: 0.0003, step: 0.0 };
        let noisy = scanner.scan(&wall, 7);
        assert_eq!(noisy.pixels, clean.pixels);
        let mut sum_sq = 0.0;
        for (a, b) in clean.points.iter().zip(&noisy.points) {
            let (a, b) = (Vector3::from(*a), Vector3::from(*b));
            assert!(a.cross(&b).norm() < 1e-12 * a.norm_squared());
            let sigma = 0.02 + 0.0003 * a.norm_squared();
            sum_sq += ((b.norm() - a.norm()) / sigma).powi(2);
        }
        // The variance of 10 000 draws has a standard error of 1.4 %.
        assert!((sum_sq / 1e4 - 1.0).abs() < 0.06, "{sum_sq}");
        assert_eq!(scanner.scan(&wall, 7), noisy);
        assert_ne!(scanner.scan(&wall, 8), noisy);
    }

    #[test]
    fn quantised_ranges_are_multiples_of_the_step() {
        let mut scanner = at_origin(20, 20);
        scanner.noise.step = 0.25;
        for p in scanner.scan(&raised(plane(100.0, 1), 10.0), 0).points {
            let steps = Vector3::from(p).norm() / 0.25;
            assert!((steps - steps.round()).abs() < 1e-9);
        }
    }

    #[test]
    fn in_a_room_every_pixel_hits() {
        let mut scanner = at_origin(160, 120);
        scanner.horizontal_view = 2.4;
        scanner.max_incidence = std::f64::consts::FRAC_PI_2;
        for azimuth in 0..8 {
            let towards = Vector3::new(f64::from(azimuth).cos(), f64::from(azimuth).sin(), 1.2);
            scanner.world_from_sensor = look_at(Vector3::new(0.1, -0.2, 1.3), towards, Vector3::z());
            let scan = scanner.scan(&room(3), 0);
            assert_eq!(scan.points.len(), 160 * 120);
            for p in &scan.points {
                let p = scan.world_from_sensor * Point3::from(*p);
                assert!(p.x.abs() < ROOM_SIZE[0] / 2.0 + 1e-9 && p.y.abs() < ROOM_SIZE[1] / 2.0 + 1e-9);
                assert!((-1e-9..ROOM_SIZE[2] + 1e-9).contains(&p.z));
            }
        }
    }

    #[test]
    fn odd_input_gives_no_points() {
        let mesh = raised(plane(1.0, 1), 3.0);
        let mut blind = [at_origin(0, 10), at_origin(10, 0), at_origin(10, 10), at_origin(10, 10)];
        blind[2].horizontal_view = std::f64::consts::PI;
        blind[3].horizontal_view = f64::NAN;
        assert!(blind.iter().all(|scanner| scanner.scan(&mesh, 0).points.is_empty()));
        let seeing = at_origin(10, 10);
        assert!(seeing.scan(&Mesh::default(), 0).points.is_empty());
        assert!(seeing.scan(&raised(plane(1.0, 1), -3.0), 0).points.is_empty());
        let broken = Mesh { points: vec![[f64::NAN; 3], [1.0; 3], [2.0; 3]], triangles: vec![[0, 1, 2], [1, 1, 2]] };
        assert!(seeing.scan(&broken, 0).points.is_empty());
    }
}
