//! The place of a scanner that turns in equal steps, found from how far apart its points are.
//!
//! Such a scanner (a spinning LiDAR, a laser on a tripod) leaves points whose distance from each other
//! grows in proportion to their distance from it. Its place is therefore the one from which the ratio of both varies
//! least. The points of one ring of a spinning LiDAR are in proportion to their distance from its axis, so that the place
//! along the axis is hardly determined; see `Turning::places`.

use super::scanner::{Spaced, Weighted, deviation_of, median, weighted};
use nalgebra::{Matrix4, Vector3, Vector4};

/// Minimum median deviation of the logarithm of the spacings: below it, all points are about equally far from a scanner,
/// and other cues tell its place better (objects up to 0.17, streets and rooms from 0.35).
const MIN_VARIED: f64 = 0.25;
/// Maximum deviation that the distance from the place may leave unexplained, as a fraction (sweeps at most 0.29, scans
/// thinned by a grid at least 0.9).
const MAX_LEFT: f64 = 0.45;
/// Shares of the points, the closest together first, whose median is a start of the search.
const STARTS: [f64; 4] = [0.05, 0.2, 0.5, 1.0];
/// Maximum number of rounds from each start; a round that moves by less than this fraction of the median distance is
/// the last one.
const ROUNDS: usize = 25;
const SETTLED: f64 = 1e-3;
/// Minimum number of points from which a place is determined, and the number from which on some are passed over.
const MIN_POINTS: usize = 200;
const MAX_POINTS: usize = 1500;
/// Maximum logarithm of the deviation at a place over the least one.
const MAX_EXCESS: f64 = 0.7;

/// A scanner that turned in equal steps.
#[derive(Clone, Debug)]
pub struct Turning {
    sized: Vec<Sized>,
    place: Vector3<f64>,
    /// Median deviation that is left at the place.
    deviation: f64,
}

/// A point, and the logarithm of the distance to its nearest other point.
#[derive(Clone, Copy, Debug)]
struct Sized {
    point: Vector3<f64>,
    log_spacing: f64,
}

impl Turning {
    /// Determines the place from centred points; `None` if the spacings vary too little, or for another reason than the
    /// distance from one place.
    pub(super) fn of(spaced: &[Spaced]) -> Option<Turning> {
        if spaced.len() < MIN_POINTS {
            return None;
        }
        let sized = |s: &Spaced| Sized { point: s.point, log_spacing: s.offset.norm().ln() };
        let mut sized: Vec<Sized> = spaced.iter().map(sized).collect();
        sized.sort_by(|a, b| a.log_spacing.total_cmp(&b.log_spacing));
        let varied = deviation_of(sized.iter().map(|s| s.log_spacing).collect());
        if varied < MIN_VARIED {
            return None;
        }
        let stride = sized.len().div_ceil(MAX_POINTS);
        let sized: Vec<Sized> = sized.into_iter().step_by(stride).collect();
        let settled = |share: &f64| {
            let n = ((share * sized.len() as f64) as usize).max(1);
            settle(&sized, middle(&sized[..n]))
        };
        let places = STARTS.iter().map(settled).map(|place| (deviation(&sized, &place), place));
        let (deviation, place) = places.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (deviation <= MAX_LEFT * varied).then_some(Turning { sized, place, deviation })
    }

    /// Returns the place and others around it that explain the spacings nearly as well, each with the logarithm of how much
    /// more is left unexplained; `offsets` are in units of the distance of the nearest tenth of the points.
    pub(super) fn places(&self, offsets: impl Iterator<Item = Vector3<f64>>) -> Vec<(Vector3<f64>, f64)> {
        let mut distances: Vec<f64> = self.sized.iter().map(|s| (s.point - self.place).norm()).collect();
        let tenth = distances.len() / 10;
        let unit = *distances.select_nth_unstable_by(tenth, f64::total_cmp).1;
        let least = self.deviation.max(f64::MIN_POSITIVE);
        let excess = |place: Vector3<f64>| (place, (deviation(&self.sized, &place) / least).ln());
        let others = offsets.map(|offset| excess(self.place + unit * offset));
        std::iter::once((self.place, 0.0)).chain(others.filter(|(_, excess)| *excess <= MAX_EXCESS)).collect()
    }
}

/// Moves a place to where the spacings are best in proportion to the distance from it, by least squares with weights that
/// fall with the residual.
fn settle(sized: &[Sized], mut place: Vector3<f64>) -> Vector3<f64> {
    for _ in 0..ROUNDS {
        let (mut left, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (Sized { point, .. }, Weighted { weight, residual }) in sized.iter().zip(weighted(ratios(sized, &place))) {
            let away = point - place;
            let slope = -away / away.norm_squared().max(f64::MIN_POSITIVE);
            let row = Vector4::new(1.0, slope.x, slope.y, slope.z);
            left += weight * row * row.transpose();
            right += weight * residual * row;
        }
        // A little damping: along the axis of a ring nothing may be determined.
        let damping = 1e-6 * (left[(1, 1)] + left[(2, 2)] + left[(3, 3)]) / 3.0;
        (1..4).for_each(|axis| left[(axis, axis)] += damping);
        let Some(solved) = left.lu().solve(&right) else { break };
        let mut step = Vector3::new(solved[1], solved[2], solved[3]);
        let reach = median(sized.iter().map(|s| (s.point - place).norm()).collect());
        if !step.iter().all(|v| v.is_finite()) {
            break;
        }
        if step.norm() > 0.5 * reach {
            step *= 0.5 * reach / step.norm();
        }
        place += step;
        if step.norm() < SETTLED * reach {
            break;
        }
    }
    place
}

/// Returns the logarithms of spacing over distance from a place.
fn ratios(sized: &[Sized], place: &Vector3<f64>) -> Vec<f64> {
    let ratio = |s: &Sized| s.log_spacing - 0.5 * (s.point - place).norm_squared().max(f64::MIN_POSITIVE).ln();
    sized.iter().map(ratio).collect()
}

/// Returns the median deviation of these logarithms.
fn deviation(sized: &[Sized], place: &Vector3<f64>) -> f64 {
    deviation_of(ratios(sized, place))
}

fn middle(sized: &[Sized]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(sized.iter().map(|s| s.point[axis]).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::{NeighborIndex, Neighborhood, Point, Scanner, Spacings, estimate_normals, narrow, view_of_scanner};

    /// What a scanner of `rings` rings sees of a ground and a round wall from `place`, with noise.
    fn sweep(place: Vector3<f64>, rings: i32) -> Vec<Point> {
        let mut stream = Stream::new(7, 0);
        let mut points = Vec::new();
        for ring in 0..rings {
            let elevation = (-15.0 + 30.0 * f64::from(ring) / f64::from(rings - 1)).to_radians();
            for step in 0..900 {
                let azimuth = (0.4 * f64::from(step)).to_radians();
                let direction =
                    Vector3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
                let wall = (14.0 + 9.0 * (2.0 * azimuth).sin() + 4.0 * (5.0 * azimuth).cos()) / elevation.cos();
                let ground = if direction.z < 0.0 { -1.7 / direction.z } else { f64::INFINITY };
                let range = wall.min(ground) + 0.01 * stream.normal();
                points.push(narrow(&(place + range * direction)));
            }
        }
        points
    }

    fn turning(points: &[Point]) -> Option<Turning> {
        match Spacings::sampled(points, 4000).scanner() {
            Some(Scanner::Turning(turning)) => Some(turning),
            Some(Scanner::Camera(camera)) => panic!("{camera:?}"),
            None => None,
        }
    }

    #[test]
    fn the_axis_of_a_spinning_scanner_is_found() {
        for (place, rings) in [(Vector3::new(3.0, -8.0, 1.0), 16), (Vector3::zeros(), 64)] {
            let found = turning(&sweep(place, rings)).unwrap().place;
            assert!((found - place).xy().norm() < 1.0, "{rings}: {found}");
        }
    }

    #[test]
    fn a_sweep_was_seen_from_above_the_ground() {
        for rings in [16, 32] {
            let points = sweep(Vector3::zeros(), rings);
            let index = NeighborIndex::new(&points);
            let estimated = estimate_normals(&points, &index, Neighborhood::Nearest(20));
            let normals: Vec<Point> = estimated.iter().map(|n| n.normal).collect();
            let view = view_of_scanner(&points, &normals, &index, 0.1, &Scanner::Turning(turning(&points).unwrap()));
            assert!(view.viewpoint.xy().norm() < 2.0 && view.viewpoint.z > -1.5, "{rings}: {view:?}");
            assert!(view.sure && view.viewpoint.z < 4.0, "{rings}: {view:?}");
        }
    }

    #[test]
    fn equally_spaced_points_have_no_scanner() {
        let mut stream = Stream::new(3, 0);
        let plane: Vec<Point> = (0..20_000)
            .map(|_| narrow(&Vector3::new(stream.between(0.0, 9.0), stream.between(0.0, 5.0), 0.0)))
            .collect();
        assert!(turning(&plane).is_none());
        let grid: Vec<Point> = (0..10_000u16).map(|i| [f32::from(i % 100), f32::from(i / 100), 0.0]).collect();
        assert!(turning(&grid).is_none());
        assert!(turning(&grid[..50]).is_none() && turning(&[]).is_none());
    }
}
