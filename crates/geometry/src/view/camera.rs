//! The place of a camera, found from the offsets between neighbouring points.
//!
//! A depth camera or a scanner with a lens samples the surface on a regular grid in its image. Whatever the surface is, two
//! neighbouring points, moved along their rays to the same depth, are therefore apart in proportion to that depth. Errors
//! of the depth move the points along their rays, so they do not disturb this: the camera is determined to a small
//! fraction of its distance, and a scan that was resampled is recognised by what is left unexplained.

use super::scanner::{Spaced, Weighted, deviation_of, median, weighted};
use nalgebra::{Matrix4, Matrix6, RowVector6, Vector3, Vector4, Vector6};

/// Maximum median deviation of the logarithm of the spacings that a camera may leave unexplained: at most 0.006 for
/// depth cameras and laser scanners in rooms and in front of objects, at least 0.13 for spinning scanners, fused scans
/// and simulated random points.
const MAX_LEFT: f64 = 0.02;
/// The same before the search, when only the growth with the depth is explained: where the depth is noisy, the nearest
/// point is often not a neighbour in the image (up to 0.23).
const MAX_LEFT_BY_DEPTH: f64 = 0.3;
/// Maximum fraction of what a parallel projection along the axis leaves unexplained: scanners that move along a line have
/// no place.
const MAX_OF_PARALLEL: f64 = 0.5;
/// Maximum distance of the place from the middle of the points, in radii (cameras up to 10, scanners that move along a
/// line from 23): beyond it the perspective is too weak to tell one from the other.
const MAX_DISTANCE: f64 = 15.0;
/// Minimum number of points from which a place is determined, and the number from which on some are passed over.
const MIN_POINTS: usize = 200;
const MAX_POINTS: usize = 800;
/// Maximum number of rounds of the two searches; a round that moves by less than this fraction of the distance is the
/// last one.
const DEPTH_ROUNDS: usize = 10;
const ROUNDS: usize = 30;
const SETTLED: f64 = 1e-6;

/// A camera that sampled a scan.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Centred coordinates.
    pub(super) place: Vector3<f64>,
    /// Unit vector into the picture.
    axis: Vector3<f64>,
}

impl Camera {
    /// Determines the camera of centred points; `None` if the offsets to the nearest points are not those of a grid in
    /// an image.
    pub(super) fn of(spaced: &[Spaced]) -> Option<Camera> {
        if spaced.len() < MIN_POINTS {
            return None;
        }
        let some: Vec<Spaced> = spaced.iter().step_by(spaced.len().div_ceil(MAX_POINTS)).copied().collect();
        let middle = some.iter().map(|s| s.point).sum::<Vector3<f64>>() / some.len() as f64;
        let radius = median(some.iter().map(|s| (s.point - middle).norm()).collect());
        let start = by_depth(&some, &middle, radius)?;
        let camera = start.settled(&some, radius)?;
        let left = deviation_of(camera.residuals(&some));
        let parallel = |s: &Spaced| (s.offset - camera.axis * camera.axis.dot(&s.offset)).norm().ln();
        let is_explained =
            left <= MAX_LEFT && left <= MAX_OF_PARALLEL * deviation_of(some.iter().map(parallel).collect());
        let is_before = some.iter().all(|s| camera.axis.dot(&(s.point - camera.place)) > 0.0);
        let is_near = (camera.place - middle).norm() <= MAX_DISTANCE * radius;
        (is_explained && is_before && is_near).then_some(camera)
    }

    /// Returns the logarithms of the spacings at the same depth, over the depth.
    fn residuals(&self, spaced: &[Spaced]) -> Vec<f64> {
        spaced.iter().map(|s| self.seen(s).log_spacing).collect()
    }

    fn seen(&self, spaced: &Spaced) -> Seen {
        let ray = spaced.point - self.place;
        let depth = self.axis.dot(&ray);
        let depth = if depth.abs() > f64::MIN_POSITIVE { depth } else { f64::MIN_POSITIVE };
        let slope = self.axis.dot(&spaced.offset) / depth;
        let aside = spaced.offset - ray * slope;
        let length_sq = aside.norm_squared().max(f64::MIN_POSITIVE);
        Seen { ray, depth, slope, aside, length_sq, log_spacing: 0.5 * length_sq.ln() - depth.abs().ln() }
    }

    /// Moves the camera to where the spacings vary least, by least squares with weights that fall with the residual.
    fn settled(mut self, spaced: &[Spaced], radius: f64) -> Option<Camera> {
        for _ in 0..ROUNDS {
            let across = aside_of(&self.axis);
            let seen: Vec<Seen> = spaced.iter().map(|s| self.seen(s)).collect();
            let weights = weighted(seen.iter().map(|s| s.log_spacing).collect());
            let (mut left, mut right) = (Matrix6::zeros(), Vector6::zeros());
            for (seen, Weighted { weight, residual }) in seen.iter().zip(weights) {
                let row = seen.row(&self.axis, &across, radius);
                left += weight * row.transpose() * row;
                right += weight * residual * row.transpose();
            }
            let step = left.lu().solve(&right).filter(|step| step.iter().all(|v| v.is_finite()))?;
            let reach = (self.place - spaced[0].point).norm().max(radius);
            let place = radius * Vector3::new(step[1], step[2], step[3]);
            // A wide step is only a direction.
            let share = (0.5 * reach / place.norm()).min(0.5 / step[4].hypot(step[5])).min(1.0);
            self.place -= share * place;
            self.axis = (self.axis - share * (step[4] * across[0] + step[5] * across[1])).normalize();
            if place.norm() < SETTLED * reach {
                break;
            }
        }
        Some(self)
    }
}

/// A point and the offset to its nearest other point, as a camera sees them.
struct Seen {
    /// From the camera to the point.
    ray: Vector3<f64>,
    depth: f64,
    /// Depth of the offset over the depth.
    slope: f64,
    /// The offset after its end was moved along its ray to the depth of the point.
    aside: Vector3<f64>,
    length_sq: f64,
    log_spacing: f64,
}

impl Seen {
    /// Returns the derivatives of the logarithm: by a common offset, by the place in radii, and by the axis along
    /// `across`.
    fn row(&self, axis: &Vector3<f64>, across: &[Vector3<f64>; 2], radius: f64) -> RowVector6<f64> {
        let along = self.aside.dot(&self.ray) / self.depth;
        let by_place = (self.aside - along * axis) * (self.slope / self.length_sq) + axis / self.depth;
        let by_axis = -self.aside * (along / self.length_sq) - self.ray / self.depth;
        let [x, y, z] = (radius * by_place).into();
        RowVector6::new(1.0, x, y, z, by_axis.dot(&across[0]), by_axis.dot(&across[1]))
    }
}

/// Returns the camera that looks at the middle of the points along the direction in which the spacings grow most evenly:
/// they are a linear function of the position, zero in the plane of the camera.
fn by_depth(spaced: &[Spaced], middle: &Vector3<f64>, radius: f64) -> Option<Camera> {
    let place = |s: &Spaced| ((s.point - middle) / radius).push(1.0);
    let spacings: Vec<f64> = spaced.iter().map(|s| s.offset.norm()).collect();
    let unit = median(spacings.clone());
    let (mut plane, mut weights) = (Vector4::zeros(), vec![1.0; spaced.len()]);
    let mut logarithms = Vec::new();
    for _ in 0..DEPTH_ROUNDS {
        let (mut left, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for ((s, spacing), weight) in spaced.iter().zip(&spacings).zip(&weights) {
            left += *weight * place(s) * place(s).transpose();
            right += *weight * spacing / unit * place(s);
        }
        plane = left.lu().solve(&right)?;
        let expected: Vec<f64> = spaced.iter().map(|s| plane.dot(&place(s)).max(1e-3)).collect();
        logarithms =
            spacings.iter().zip(&expected).map(|(spacing, expected)| (spacing / unit / expected).ln()).collect();
        let robust = weighted(logarithms.clone());
        weights = robust.iter().zip(&expected).map(|(w, expected)| w.weight / (expected * expected)).collect();
    }
    let (growth, axis) = (plane.xyz().norm(), plane.xyz().try_normalize(1e-9)?);
    let camera = Camera { place: middle - axis * (radius * plane.w / growth), axis };
    (deviation_of(logarithms) <= MAX_LEFT_BY_DEPTH).then_some(camera)
}

/// Returns two directions across a unit vector and each other.
fn aside_of(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let first = axis.cross(&other).normalize();
    [first, axis.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::{Point, Scanner, Spacings, narrow, voxel_centroids};
    use nalgebra::{Isometry3, Point3};

    /// An image of a wavy wall and a floor, `noise` of the depth being its standard deviation at depth one.
    fn image(noise: f64) -> Vec<Vector3<f64>> {
        let mut stream = Stream::new(5, 0);
        let mut points = Vec::new();
        for row in -60..60 {
            for column in -80..80 {
                let ray = Vector3::new(f64::from(column), f64::from(row), 120.0) / 120.0;
                let wall = 3.0 + 0.6 * (4.0 * ray.x).sin() + 0.3 * (7.0 * ray.y).cos();
                let floor = if ray.y > 0.0 { 0.8 / ray.y } else { f64::INFINITY };
                let depth = wall.min(floor);
                points.push(ray * (depth + noise * depth * depth * stream.normal()));
            }
        }
        points
    }

    fn moved(points: &[Vector3<f64>], motion: &Isometry3<f64>) -> Vec<Point> {
        points.iter().map(|p| narrow(&(motion * Point3::from(*p)).coords)).collect()
    }

    fn found(points: &[Point]) -> Option<Camera> {
        match Spacings::sampled(points, 4000).scanner()? {
            Scanner::Camera(camera) => Some(camera),
            Scanner::Turning(_) => None,
        }
    }

    #[test]
    fn a_camera_is_found_wherever_its_picture_was_moved_and_however_noisy_the_depth_is() {
        let motion = Isometry3::new(Vector3::new(2.0, -1.0, 3.0), Vector3::new(0.4, -1.1, 0.7));
        for noise in [0.0, 0.002, 0.005] {
            let camera = found(&moved(&image(noise), &motion)).unwrap_or_else(|| panic!("noise {noise}"));
            let off = (camera.place - motion.translation.vector).norm();
            let angle = camera.axis.angle(&(motion * Vector3::z()));
            assert!(off < 0.02 && angle < 0.005, "noise {noise}: {off} {angle}");
        }
    }

    #[test]
    fn what_was_resampled_or_seen_in_parallel_has_no_camera() {
        let picture = image(0.001);
        let thinned = voxel_centroids(&moved(&picture, &Isometry3::identity()), None, 0.05);
        assert!(found(&thinned.points).is_none());
        let parallel: Vec<Vector3<f64>> = (0..20_000u16)
            .map(|i| (f64::from(i % 160), f64::from(i / 160)))
            .map(|(x, y)| Vector3::new(x, y, 9.0 * (0.1 * x).sin() * (0.07 * y).cos()))
            .collect();
        assert!(found(&moved(&parallel, &Isometry3::identity())).is_none());
        let mut stream = Stream::new(3, 0);
        let loose: Vec<Vector3<f64>> =
            (0..5000).map(|_| Vector3::new(stream.unit(), stream.unit(), 0.1 * stream.unit())).collect();
        assert!(found(&moved(&loose, &Isometry3::identity())).is_none());
    }

    #[test]
    fn the_derivatives_are_those_of_the_logarithm() {
        let axis = Vector3::new(0.2, -0.3, 0.9).normalize();
        let camera = Camera { place: Vector3::new(0.3, 0.1, -2.0), axis };
        let spaced = Spaced { point: Vector3::new(0.5, -0.4, 1.0), offset: Vector3::new(0.02, 0.01, -0.03) };
        let (across, radius) = (aside_of(&axis), 1.7);
        let row = camera.seen(&spaced).row(&axis, &across, radius);
        let logarithm = |place: Vector3<f64>, axis: Vector3<f64>| Camera { place, axis }.seen(&spaced).log_spacing;
        let step = 1e-6;
        let slope = |at: &dyn Fn(f64) -> f64| (at(step) - at(-step)) / (2.0 * step);
        for direction in 0..3 {
            let moved = |t: f64| logarithm(camera.place + radius * t * Vector3::ith(direction, 1.0), axis);
            assert!((row[1 + direction] - slope(&moved)).abs() < 1e-6, "{direction}: {row}");
        }
        for (direction, across) in across.iter().enumerate() {
            let turned = |t: f64| logarithm(camera.place, (axis + t * across).normalize());
            assert!((row[4 + direction] - slope(&turned)).abs() < 1e-6, "{direction}: {row}");
        }
    }

    #[test]
    fn degenerate_points_have_no_camera() {
        let line: Vec<Point> = (0..500u16).map(|i| [f32::from(i), 0.0, 0.0]).collect();
        let plane: Vec<Point> = (0..900u16).map(|i| [f32::from(i % 30), f32::from(i / 30), 0.0]).collect();
        for points in [&line[..], &plane, &line[..150], &[]] {
            assert!(found(points).is_none(), "{}", points.len());
        }
    }
}
