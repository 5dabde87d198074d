//! Two scans of one shape, and the true motion between them.

use crate::Mesh;
use crate::nuisances;
use crate::scanner::{RangeNoise, VirtualScanner};
use crate::shapes::figurine;
use congruent_geometry::{NeighborIndex, Point, RawScan, RigidTransform, narrow, resolution};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Maximum distance, in resolutions of the target, at which points of two scans count as the same.
const OVERLAP_RADIUS_PR: f64 = 2.0;
/// Elevation of both scanners, radians: slightly from above, so that heads and arms hide something.
const ELEVATION: f64 = 0.25;
/// Distance of both scanners, in radii of the figurine.
const DISTANCE_FACTOR: f64 = 3.5;

/// Two scans, each in its own sensor's frame, and what their registration should find.
#[derive(Clone, Debug)]
pub struct ScanPair {
    /// The scan to be moved.
    pub source: RawScan,
    /// The scan that stays.
    pub target: RawScan,
    /// The true motion, exact up to rounding in `f64`.
    pub target_from_source: RigidTransform,
    /// Fraction of source points with a target point within two resolutions of the target.
    pub overlap: f64,
}

impl ScanPair {
    /// Returns the same pair with each scan moved by its own motion, and the true motion adapted.
    #[must_use]
    pub fn moved(&self, source_motion: &RigidTransform, target_motion: &RigidTransform) -> ScanPair {
        ScanPair {
            source: nuisances::moved(&self.source, source_motion),
            target: nuisances::moved(&self.target, target_motion),
            target_from_source: target_motion * self.target_from_source * source_motion.inverse(),
            overlap: self.overlap,
        }
    }
}

/// The parameters of a pair of figurine scans.
#[derive(Clone, Debug, PartialEq)]
pub struct PairOptions {
    /// Seed of the shape and of the noise.
    pub seed: u64,
    /// Azimuth of the source's view, radians.
    pub azimuth: f64,
    /// Angle from the source's view to the target's around the figurine, radians.
    pub view_angle: f64,
    /// Image side of both scanners.
    pub pixels: u32,
    /// Noise of both scanners.
    pub noise: RangeNoise,
}

impl Default for PairOptions {
    /// Returns two noise-free views of 300 × 300 pixels, 40° apart.
    fn default() -> Self {
        PairOptions { seed: 1, azimuth: 0.0, view_angle: 40f64.to_radians(), pixels: 300, noise: RangeNoise::default() }
    }
}

/// Scans the figurine from two sides.
#[must_use]
pub fn figurine_pair(options: &PairOptions) -> ScanPair {
    let mesh = figurine(options.seed);
    let scanner = |azimuth| VirtualScanner {
        noise: options.noise,
        ..VirtualScanner::orbit(&mesh, azimuth, ELEVATION, DISTANCE_FACTOR, options.pixels)
    };
    scan_pair(&mesh, &scanner(options.azimuth), &scanner(options.azimuth + options.view_angle), options.seed)
}

/// Scans any mesh with two scanners, each with its own noise.
#[must_use]
pub fn scan_pair(mesh: &Mesh, source: &VirtualScanner, target: &VirtualScanner, seed: u64) -> ScanPair {
    // The two views must not share their noise.
    let (source_scan, target_scan) =
        (source.scan(mesh, seed.wrapping_mul(2)), target.scan(mesh, seed.wrapping_mul(2) + 1));
    let target_from_source = target.world_from_sensor.inverse() * source.world_from_sensor;
    let (source, target) = (source_scan.cloud(), target_scan.cloud());
    let radius = OVERLAP_RADIUS_PR * mean_spacing(&target).unwrap_or(0.0);
    let overlap = overlap(&source, &target, &target_from_source, radius);
    ScanPair { source, target, target_from_source, overlap }
}

/// Returns the fraction of source points that have a target point within `radius` (data units) once moved by the true
/// motion. Points that are not finite find nothing; zero without source points.
#[must_use]
pub fn overlap(source: &RawScan, target: &RawScan, target_from_source: &RigidTransform, radius: f64) -> f64 {
    let origin = first_finite(target);
    let index = NeighborIndex::new(&relative(target, &origin));
    let radius_sq = radius * radius;
    let is_met = |p: [f64; 3]| {
        let query = narrow(&(target_from_source * Point3::from(p) - origin).coords);
        let finite = query.iter().all(|v| v.is_finite());
        finite && index.nearest(&query).is_some_and(|hit| f64::from(hit.distance_sq) <= radius_sq)
    };
    let n_met = (0..source.points.len()).into_par_iter().filter(|&i| is_met(source.points.at(i))).count();
    n_met as f64 / source.points.len().max(1) as f64
}

/// Returns the mean distance between neighbouring points; `None` for fewer than two distinct ones.
fn mean_spacing(scan: &RawScan) -> Option<f64> {
    let points = relative(scan, &first_finite(scan));
    Some(resolution(&points, &NeighborIndex::new(&points))?.mean)
}

/// Returns a point to subtract before coordinates become `f32`.
fn first_finite(scan: &RawScan) -> Vector3<f64> {
    let first = scan.points.iter().find(|p| p.iter().all(|v| v.is_finite()));
    first.map_or_else(Vector3::zeros, Vector3::from)
}

fn relative(scan: &RawScan, origin: &Vector3<f64>) -> Vec<Point> {
    let points = scan.points.iter().map(|p| narrow(&(Vector3::from(p) - origin)));
    points.filter(|p| p.iter().all(|v| v.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small(view_angle: f64) -> PairOptions {
        PairOptions { view_angle, pixels: 120, ..PairOptions::default() }
    }

    #[test]
    fn the_truth_maps_source_points_onto_the_surface_the_target_sees() {
        // Both scanners see the same flat facets, so a source point moved by the true motion lies on the facet that the
        // target's neighbouring pixels span. A plane is the simplest case, and has no pixel-sized error.
        let wall = crate::shapes::plane(10.0, 3);
        let looks = [0.3, 1.5].map(|azimuth| VirtualScanner::orbit(&wall, azimuth, 0.8, 3.0, 50));
        let pair = scan_pair(&wall, &looks[0], &looks[1], 0);
        let sensor_from_world = looks[1].world_from_sensor.inverse();
        let normal = sensor_from_world * Vector3::z();
        let on_plane = sensor_from_world * Point3::origin();
        assert!(pair.source.points.len() > 800 && pair.overlap > 0.99);
        for p in pair.source.points.iter() {
            let p = pair.target_from_source * Point3::from(p);
            assert!((p - on_plane).dot(&normal).abs() < 1e-9);
        }
    }

    #[test]
    fn noise_free_scans_lie_on_the_figurine() {
        let mesh = figurine(2);
        let scanner = VirtualScanner::orbit(&mesh, 0.8, 0.1, 3.0, 60);
        let scan = scanner.scan(&mesh, 0);
        let corners = |t: &[u32; 3]| t.map(|i| Vector3::from(mesh.points[i as usize]));
        for p in scan.points.iter().step_by(29) {
            let p = (scan.world_from_sensor * Point3::from(*p)).coords;
            let nearest = mesh.triangles.iter().filter_map(|t| plane_distance_inside(&corners(t), &p));
            let distance = nearest.fold(f64::INFINITY, f64::min);
            assert!(distance < 1e-6, "{distance}");
        }
    }

    /// Distance to a triangle's plane, for points whose projection is inside the triangle or within a millionth of it.
    fn plane_distance_inside([a, b, c]: &[Vector3<f64>; 3], p: &Vector3<f64>) -> Option<f64> {
        let normal = (b - a).cross(&(c - a));
        let area = normal.norm();
        let share = |u: &Vector3<f64>, v: &Vector3<f64>| (u - p).cross(&(v - p)).dot(&normal) / (area * area);
        let inside = share(a, b) > -1e-6 && share(b, c) > -1e-6 && share(c, a) > -1e-6;
        inside.then(|| ((p - a).dot(&normal) / area).abs())
    }

    #[test]
    fn overlap_falls_with_the_angle_between_the_views() {
        let overlaps = [0.0, 30.0, 80.0, 180.0].map(|deg: f64| figurine_pair(&small(deg.to_radians())).overlap);
        assert_eq!(overlaps[0], 1.0);
        assert!(overlaps.windows(2).all(|w| w[1] < w[0] - 0.1), "{overlaps:?}");
        assert!((0.55..0.95).contains(&overlaps[1]), "{overlaps:?}");
        assert!(overlaps[3] < 0.25, "{overlaps:?}");
    }

    #[test]
    fn moving_the_scans_keeps_the_truth_true() {
        let pair = figurine_pair(&small(0.6));
        let motion = |x: f64| RigidTransform::new(Vector3::new(90.0, x, -7.0), Vector3::new(x, 0.4, -1.0));
        let moved = pair.moved(&motion(1.3), &motion(-0.2));
        let radius = OVERLAP_RADIUS_PR * mean_spacing(&pair.target).unwrap();
        let again = overlap(&moved.source, &moved.target, &moved.target_from_source, radius);
        // Points at the very edge of the radius may change sides by rounding.
        assert!((again - pair.overlap).abs() < 1e-3);
        assert!(overlap(&moved.source, &moved.target, &pair.target_from_source, radius) < 0.1);
    }

    #[test]
    fn the_same_options_give_the_same_pair_on_any_number_of_threads() {
        let options = PairOptions { noise: RangeNoise::gaussian(0.1), ..small(0.5) };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| figurine_pair(&options))
        };
        let (one, four) = (on(1), on(4));
        assert_eq!((one.source, one.target, one.overlap), (four.source, four.target, four.overlap));
    }

    #[test]
    fn nothing_overlaps_nothing() {
        let empty = RawScan::default();
        let one = RawScan { points: vec![[1.0; 3], [f64::NAN; 3]].into(), ..RawScan::default() };
        let identity = RigidTransform::identity();
        assert_eq!(overlap(&empty, &one, &identity, 1.0), 0.0);
        assert_eq!(overlap(&one, &empty, &identity, 1.0), 0.0);
        assert_eq!(overlap(&one, &one, &identity, 1.0), 0.5);
    }
}
