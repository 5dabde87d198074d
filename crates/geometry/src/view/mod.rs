//! The viewpoint of a scan, estimated from its points alone.
//!
//! A scanner that turns in equal steps, or samples on a grid in an image, leaves points whose spacing gives its place away
//! (see [`Scanner`]). Otherwise the surface has to: seen from one side it hides nothing from there, its normals can all be
//! turned towards it without tearing neighbours apart, and they face it on average. That settles an axis. Its sign is
//! settled by convexity: on the whole, scanned objects bulge towards the scanner; of planes that says nothing. What does
//! not fit a far viewpoint is tried with near ones (a room seen from within), and what fits none is taken for a closed
//! model. So is what hides much of itself from every side, nevertheless seems to have been seen from outside, and bulges
//! once its signs have been propagated.

mod camera;
mod cloud;
mod dome;
mod scanner;
mod screen;
mod turning;

use crate::flatness::{MOSTLY_FLAT, flatness};
use crate::normals::propagate;
use crate::{NeighborIndex, Point, narrow, wide};
use cloud::{Cloud, sphere};
use nalgebra::Vector3;

pub use camera::Camera;
pub use scanner::Scanner;
pub(crate) use scanner::Spaced;
pub use turning::Turning;

/// Upper bounds of the fractions of torn edges and of hidden points of a scan seen from one side (measured on 92
/// scans).
const ONE_SIDE_TORN: f64 = 0.004;
const ONE_SIDE_HIDDEN: f64 = 0.1;
/// Mean convexity below which its sign is not reliable.
const SURE_CONVEXITY: f64 = 0.012;
/// Maximum cost of a near viewpoint that explains a scan.
const NEAR_COST: f64 = -0.03;
/// Fraction of hidden points above which a scan hides much of itself from everywhere (rooms seen from outside at most
/// 0.16, closed models at least 0.31).
const MUCH_HIDDEN: f64 = 0.25;
/// Lower bound of the bulge of a closed model (see [`Cloud::bulge`]; closed models at least 0.29, a street and rooms
/// seen from outside at most 0.15).
const CLOSED_BULGE: f64 = 0.2;
/// Number of points at which the flatness is measured.
const FLATNESS_AT: usize = 600;
/// Distances of the places that are tried around that of a turning scanner, in units of the distance of the nearest tenth
/// of the points, and the number of directions.
const TURNING_OFFSETS: [f64; 5] = [0.1, 0.2, 0.35, 0.6, 1.0];
const TURNING_DIRECTIONS: usize = 60;
/// Distance of the far viewpoint of a scan seen from one side, in radii of the cloud.
const FAR: f64 = 30.0;

/// What a scan looks like from its viewpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewKind {
    /// Seen from one side: a range scan of an object, a frame of a camera.
    OneSide,
    /// Seen from a near viewpoint.
    Near,
    /// Seen from within, or a closed model: from its middle the two look alike, but their normals are opposite.
    Within,
    /// No single viewpoint explains it: a complete model, or fused scans.
    Closed,
}

/// An estimated viewpoint.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The kind of view.
    pub kind: ViewKind,
    /// Centred coordinates; meaningless for `Closed`.
    pub viewpoint: Vector3<f64>,
    /// Whether the sign (towards or away) is reliable.
    pub sure: bool,
}

/// Estimates the viewpoint of points with unsigned normals; `unit` is the working length, about half the distance
/// between neighbours.
#[must_use]
pub fn estimate_view(points: &[Point], normals: &[Point], index: &NeighborIndex, unit: f64) -> View {
    let cloud = Cloud::new(points, normals, index, unit);
    let (direction, torn, hidden) = cloud.best_axis();
    let convexity = cloud.convexity(|i| wide(normals[i]).dot(&direction) >= 0.0);
    let towards = if convexity < 0.0 { -direction } else { direction };
    let one_side = View {
        kind: ViewKind::OneSide,
        viewpoint: cloud.middle + towards * (FAR * cloud.radius),
        sure: convexity.abs() >= SURE_CONVEXITY && !is_flat(normals),
    };
    let nearly = torn < 2.0 * ONE_SIDE_TORN && one_side.sure;
    if hidden < ONE_SIDE_HIDDEN && (torn < ONE_SIDE_TORN || nearly) {
        return one_side;
    }
    let (viewpoint, cost) = cloud.best_near();
    let is_outside = (viewpoint - cloud.middle).norm() > cloud.radius;
    let hides_much = hidden > MUCH_HIDDEN;
    let kind = match (hides_much, is_outside) {
        _ if cost > NEAR_COST => ViewKind::Closed,
        (true, true) if bulges(points, normals, index, &cloud) => ViewKind::Closed,
        (true, false) => ViewKind::Within,
        _ => ViewKind::Near,
    };
    View { kind, viewpoint, sure: is_outside && kind == ViewKind::Near }
}

/// Determines the viewpoint of a scan whose scanner is known: the place of a camera, or of the places that explain the
/// spacings of a turning scanner the one that explains the surface best. The points may be thinned; `unit` is their
/// working length.
#[must_use]
pub fn view_of_scanner(
    points: &[Point],
    normals: &[Point],
    index: &NeighborIndex,
    unit: f64,
    scanner: &Scanner,
) -> View {
    match scanner {
        Scanner::Camera(camera) => View { kind: ViewKind::OneSide, viewpoint: camera.place, sure: true },
        Scanner::Turning(turning) => {
            let cloud = Cloud::new(points, normals, index, unit);
            let around = TURNING_OFFSETS.iter().flat_map(|length| sphere(TURNING_DIRECTIONS).map(move |d| d * *length));
            View { kind: ViewKind::Near, viewpoint: cloud.clearest(&turning.places(around)), sure: true }
        }
    }
}

/// Returns whether the surface is mostly planes: a corner of a room is, turned inside out, the corner of a box.
fn is_flat(normals: &[Point]) -> bool {
    let some: Vec<Point> = normals.iter().step_by(normals.len().div_ceil(FLATNESS_AT).max(1)).copied().collect();
    flatness(&some) >= MOSTLY_FLAT
}

/// Returns whether the surface bulges on the whole once its signs have been propagated from neighbour to neighbour.
fn bulges(points: &[Point], normals: &[Point], index: &NeighborIndex, cloud: &Cloud<'_>) -> bool {
    let mut signed = normals.to_vec();
    propagate(points, index, &mut signed);
    cloud.bulge(&signed) > CLOSED_BULGE
}

/// Turns normals towards a viewpoint.
pub(crate) fn face(viewpoint: &Vector3<f64>, points: &[Point], normals: &mut [Point]) {
    for (point, normal) in points.iter().zip(normals) {
        if (viewpoint - wide(*point)).dot(&wide(*normal)) < 0.0 {
            *normal = narrow(&-wide(*normal));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::cloud::sphere;
    use super::*;
    use crate::random::Stream;
    use crate::{Neighborhood, estimate_normals};

    fn view_of(points: &[Point], unit: f64) -> View {
        let index = NeighborIndex::new(points);
        let normals: Vec<Point> =
            estimate_normals(points, &index, Neighborhood::Nearest(20)).iter().map(|n| n.normal).collect();
        estimate_view(points, &normals, &index, unit)
    }

    /// Points of a bumpy unit sphere, about 0.02 apart, for which `keep` holds.
    fn bumpy(keep: impl Fn(&Vector3<f64>) -> bool) -> Vec<Point> {
        let radius =
            |d: &Vector3<f64>| 1.0 + 0.05 * (7.0 * d.x + 1.0).sin() * (6.0 * d.y).cos() + 0.04 * (9.0 * d.z).sin();
        sphere(30_000).map(|d| d * radius(&d)).filter(keep).map(|p| narrow(&p)).collect()
    }

    #[test]
    fn half_an_object_was_seen_from_its_side() {
        for from in [Vector3::new(0.3, -0.5, 0.8).normalize(), Vector3::new(-0.9, 0.1, -0.4).normalize()] {
            let view = view_of(&bumpy(|p| p.dot(&from) > 0.35), 0.01);
            assert!(view.kind == ViewKind::OneSide && view.sure, "{view:?}");
            let direction = view.viewpoint.normalize();
            assert!(direction.dot(&from) > 0.9, "{direction} {from}");
        }
    }

    #[test]
    fn a_whole_object_was_seen_from_nowhere() {
        let view = view_of(&bumpy(|_| true), 0.01);
        assert!(view.kind != ViewKind::OneSide && !view.sure, "{view:?}");
    }

    /// From any viewpoint outside, its other side is hidden, and from within it hides itself.
    #[test]
    fn a_long_model_was_seen_from_nowhere() {
        let long: Vec<Point> = bumpy(|_| true)
            .iter()
            .map(|p| {
                let (sin, cos) = (1.2 * p[2]).sin_cos();
                [0.45 * p[0] + 1.8 * cos, 0.45 * p[1], 2.0 * sin]
            })
            .collect();
        let view = view_of(&long, 0.01);
        assert!(view.kind == ViewKind::Closed && !view.sure, "{view:?}");
    }

    #[test]
    fn a_room_is_seen_from_within() {
        // The inside of a box of 6 by 4 by 3, seen by a scanner inside it.
        let mut stream = Stream::new(8, 0);
        let points: Vec<Point> = (0..20_000)
            .map(|i| {
                let mut p = [stream.between(0.0, 6.0), stream.between(0.0, 4.0), stream.between(0.0, 3.0)];
                let axis = i % 3;
                p[axis] = if stream.below(2) == 0 { 0.0 } else { [6.0, 4.0, 3.0][axis] };
                p.map(|v| v as f32)
            })
            .collect();
        let view = view_of(&points, 0.03);
        assert!(view.kind == ViewKind::Within && !view.sure, "{view:?}");
        assert!((0..3).all(|a| view.viewpoint[a] > 0.0 && view.viewpoint[a] < [6.0, 4.0, 3.0][a]), "{view:?}");
    }

    #[test]
    fn few_points_do_not_matter() {
        for n in 0..5 {
            let points: Vec<Point> = (0..n).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
            let _ = view_of(&points, 1.0);
        }
    }
}
