//! Where a scan was taken from, estimated from its points alone.
//!
//! A surface that was seen from one side hides nothing from there, its normals can all be turned towards there without
//! tearing neighbours apart, and they look there on average. That settles an axis. Its sign is settled by convexity:
//! scanned things bulge towards the scanner on the whole. What does not fit a far viewpoint is tried with near ones (a
//! room seen from within), and what fits none is taken for a closed model.

use crate::screen::{Columns, Screen, columns, facing_sides, project};
use crate::{NeighborIndex, Point, RadiusSearch, narrow, random::Stream, wide};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Directions of the sphere that are tried; half of them, because an axis has no sign.
const DIRECTIONS: usize = 128;
/// Rings of refinement around the best directions, radians.
const RINGS: [f64; 3] = [0.14, 0.08, 0.04];
/// Shares of torn edges and of hidden points that a scan seen from one side stays below (measured on 92 scans).
const ONE_SIDE_TORN: f64 = 0.004;
const ONE_SIDE_HIDDEN: f64 = 0.1;
/// Mean convexity below which its sign says nothing.
const SURE_CONVEXITY: f64 = 0.012;
/// Near viewpoints are tried at these multiples of the cloud's radius from its middle.
const NEAR_DISTANCES: [f64; 8] = [0.15, 0.35, 0.6, 0.9, 1.3, 1.8, 2.5, 4.0];
const NEAR_DIRECTIONS: usize = 48;
const NEAR_STEPS: usize = 80;
/// A near viewpoint that costs more than this explains nothing.
const NEAR_COST: f64 = -0.03;
/// The far viewpoint of a scan seen from one side, in radii of the cloud.
const FAR: f64 = 30.0;

/// What a scan looks like from where it was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewKind {
    /// Seen from one side: a range scan of an object.
    OneSide,
    /// Seen from a near viewpoint, or from within.
    Near,
    /// No single viewpoint explains it: a complete model, or fused scans.
    Closed,
}

/// An estimated viewpoint.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Which case.
    pub kind: ViewKind,
    /// Centred coordinates; meaningless for `Closed`.
    pub viewpoint: Vector3<f64>,
    /// Whether the sign (towards or away) can be relied on.
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
        sure: convexity.abs() >= SURE_CONVEXITY,
    };
    let nearly = torn < 2.0 * ONE_SIDE_TORN && one_side.sure;
    if hidden < ONE_SIDE_HIDDEN && (torn < ONE_SIDE_TORN || nearly) {
        return one_side;
    }
    let (viewpoint, cost) = cloud.best_near();
    if cost > NEAR_COST {
        return View { kind: ViewKind::Closed, viewpoint, sure: false };
    }
    View { kind: ViewKind::Near, viewpoint, sure: (viewpoint - cloud.middle).norm() > cloud.radius }
}

/// Two neighbours whose normals are nearly parallel, and whether they point the same way as they are stored.
struct Edge {
    ends: [u32; 2],
    aligned: bool,
}

/// Offsets farther than so many units are no edges; an edge goes to so many nearest ones; every other point has its own.
const EDGE_REACH: f64 = 5.0;
const EDGES: usize = 6;
/// Every third point and edge suffices to compare directions.
const STRIDE: usize = 3;

struct Cloud<'a> {
    points: &'a [Point],
    normals: &'a [Point],
    index: &'a NeighborIndex,
    unit: f64,
    edges: Vec<Edge>,
    columns: Columns,
    /// Of every third point.
    few: Columns,
    normal_columns: Columns,
    middle: Vector3<f64>,
    /// Distance of the farthest point from the middle.
    radius: f64,
}

/// What a thread uses again from direction to direction.
#[derive(Default)]
struct Workplace {
    sides: Vec<u8>,
    pixels: Vec<u32>,
    depths: Vec<f32>,
    front: Vec<f32>,
}

impl<'a> Cloud<'a> {
    fn new(points: &'a [Point], normals: &'a [Point], index: &'a NeighborIndex, unit: f64) -> Self {
        let middle = points.iter().map(|p| wide(*p)).sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let radius = points.iter().map(|p| (wide(*p) - middle).norm()).fold(0.0, f64::max);
        let search = RadiusSearch::among(points, index, EDGE_REACH * unit);
        let of_point = |near: &mut Vec<(u32, u32)>, i: usize| {
            near.clear();
            search.visit(&points[i], |n| near.push((n.distance_sq.to_bits(), n.index)));
            near.retain(|&(_, other)| other != i as u32);
            // Bits of distances ascend with them.
            near.sort_unstable();
            let edge = |&(_, other): &(u32, u32)| {
                let cosine = wide(normals[i]).dot(&wide(normals[other as usize]));
                (cosine.abs() > 0.7).then_some(Edge { ends: [i as u32, other], aligned: cosine > 0.0 })
            };
            near.iter().take(EDGES).filter_map(edge).collect::<Vec<_>>()
        };
        let some = (0..points.len()).into_par_iter().step_by(2);
        let edges: Vec<Vec<Edge>> = some.map_init(Vec::new, of_point).collect();
        let few: Vec<Point> = points.iter().step_by(STRIDE).copied().collect();
        Cloud {
            points,
            normals,
            index,
            unit,
            edges: edges.into_iter().flatten().collect(),
            columns: columns(points),
            few: columns(&few),
            normal_columns: columns(normals),
            middle,
            radius,
        }
    }

    /// The axis of least cost, its torn edges and its hidden points.
    fn best_axis(&self) -> (Vector3<f64>, f64, f64) {
        let cost = |workplace: &mut Workplace, d: &Vector3<f64>| {
            let (torn, hidden, facing) = self.axis_terms(workplace, d, &self.few, STRIDE);
            torn + hidden - 0.1 * facing
        };
        let candidates: Vec<Vector3<f64>> = sphere(DIRECTIONS).filter(|d| d.z >= 0.0).collect();
        let mut costs: Vec<(f64, usize)> =
            candidates.par_iter().map_init(Workplace::default, cost).collect::<Vec<_>>().into_iter().zip(0..).collect();
        costs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let refined: Vec<(f64, Vector3<f64>)> = costs
            .par_iter()
            .take(3)
            .map_init(Workplace::default, |workplace, &(start, i)| {
                refine_direction(candidates[i], start, |d| cost(workplace, d))
            })
            .collect();
        let (_, best) = refined.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or((0.0, Vector3::z()));
        let (torn, hidden, _) = self.axis_terms(&mut Workplace::default(), &best, &self.columns, 1);
        (best, torn, hidden)
    }

    /// From far along `d`: torn edges (of every `stride`-th) and hidden points (of some), both as shares, and the mean |n·d|.
    fn axis_terms(
        &self,
        workplace: &mut Workplace,
        d: &Vector3<f64>,
        points: &Columns,
        stride: usize,
    ) -> (f64, f64, f64) {
        let Workplace { sides, .. } = workplace;
        sides.resize(self.normals.len(), 0);
        let facing = facing_sides(&self.normal_columns, narrow(d), sides);
        let torn = self.torn(stride, |i| sides[i]);
        let hidden = self.hidden_from_far(workplace, d, points);
        (torn, hidden, facing / self.normals.len().max(1) as f64)
    }

    /// Share of edges whose ends would be turned apart; `side` says whether a point's normal would be turned.
    fn torn<T: PartialEq>(&self, stride: usize, side: impl Fn(usize) -> T) -> f64 {
        let edges = self.edges.iter().step_by(stride);
        let torn = edges.filter(|e| (side(e.ends[0] as usize) == side(e.ends[1] as usize)) != e.aligned).count();
        torn as f64 / self.edges.len().div_ceil(stride).max(1) as f64
    }

    /// Share of points that lie more than 12 units behind the first of their pixel, seen from far along `d`.
    fn hidden_from_far(&self, workplace: &mut Workplace, d: &Vector3<f64>, points: &Columns) -> f64 {
        let Workplace { pixels, depths, front, .. } = workplace;
        let right = perpendicular(d);
        let pixel = (4.0 * self.unit).max(self.radius / 1000.0);
        let width = (2.0 * self.radius / pixel) as usize + 2;
        let screen = Screen {
            axes: [right, d.cross(&right), *d].map(|axis| narrow(&axis)),
            middle: narrow(&self.middle),
            half: self.radius as f32,
            per_pixel: (1.0 / pixel) as f32,
            width: width as u32,
        };
        let n = points[0].len();
        pixels.resize(n, 0);
        depths.resize(n, 0.0);
        project(points, &screen, pixels, depths);
        front.clear();
        front.resize(width * width, f32::NEG_INFINITY);
        for (&pixel, &depth) in pixels.iter().zip(depths.iter()) {
            let at = &mut front[pixel as usize];
            *at = if depth > *at { depth } else { *at };
        }
        let behind = (12.0 * self.unit) as f32;
        let seen = pixels.iter().zip(depths.iter());
        let hidden: u32 = seen.map(|(&pixel, &depth)| u32::from(depth < front[pixel as usize] - behind)).sum();
        f64::from(hidden) / n.max(1) as f64
    }

    /// Mean of −(m·n)/8 units, `m` the mean offset of the neighbours: above zero for bulges. `keep` says whether the
    /// stored normal of a point is turned to the assumed side already.
    fn convexity(&self, keep: impl Fn(usize) -> bool + Sync) -> f64 {
        let reach = 8.0 * self.unit;
        let search = RadiusSearch::among(self.points, self.index, reach);
        let bulge = |i: usize| {
            let point = wide(self.points[i]);
            let (mut sum, mut count) = (Vector3::zeros(), 0.0);
            search.visit(&self.points[i], |n| {
                sum += wide(self.points[n.index as usize]) - point;
                count += 1.0;
            });
            if count < 6.0 { 0.0 } else { -(sum / count).dot(&wide(self.normals[i])) / reach }
        };
        let some = (0..self.points.len()).into_par_iter().step_by(4);
        let sampled: Vec<f64> = some.map(|i| if keep(i) { bulge(i) } else { -bulge(i) }).collect();
        sampled.iter().sum::<f64>() / sampled.len().max(1) as f64
    }

    /// The near viewpoint of least cost, and the cost.
    fn best_near(&self) -> (Vector3<f64>, f64) {
        let around = NEAR_DISTANCES.iter().flat_map(|z| sphere(NEAR_DIRECTIONS).map(move |d| d * *z));
        let candidates: Vec<Vector3<f64>> =
            std::iter::once(Vector3::zeros()).chain(around).map(|offset| self.middle + offset * self.radius).collect();
        let costs: Vec<f64> = candidates.par_iter().map(|v| self.near_cost(v)).collect();
        let first = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        let (mut best, mut cost) = (candidates[first], costs[first]);
        let mut step = 0.3 * (0.5 * self.radius).max((best - self.middle).norm());
        let mut stream = Stream::new(3, 0);
        for round in 1..=NEAR_STEPS {
            let trial = best + step * Vector3::from_fn(|_, _| stream.normal());
            let trial_cost = self.near_cost(&trial);
            if trial_cost < cost {
                (best, cost) = (trial, trial_cost);
            } else if round % 20 == 0 {
                step *= 0.6;
            }
        }
        (best, cost)
    }

    fn near_cost(&self, viewpoint: &Vector3<f64>) -> f64 {
        let ray = |i: usize| viewpoint - wide(self.points[i]);
        let sampled = (0..self.points.len()).step_by(3);
        let facing: f64 =
            sampled.clone().map(|i| (wide(self.normals[i]).dot(&ray(i)) / ray(i).norm().max(1e-12)).abs()).sum();
        let torn = self.torn(2, |i| wide(self.normals[i]).dot(&ray(i)) >= 0.0);
        torn + 0.2 * self.hidden_from_near(viewpoint) - 0.1 * facing / sampled.len().max(1) as f64
    }

    /// Share of points far behind the first in their direction, on a sphere of 180 by 90 pixels.
    fn hidden_from_near(&self, viewpoint: &Vector3<f64>) -> f64 {
        use std::f64::consts::PI;
        let seen: Vec<(usize, f64)> = self
            .points
            .iter()
            .step_by(3)
            .map(|p| {
                let offset = wide(*p) - viewpoint;
                let distance = offset.norm().max(1e-12);
                let row = ((offset.z / distance).clamp(-1.0, 1.0).acos() / PI * 90.0) as usize;
                let column = ((offset.y.atan2(offset.x) + PI) / (2.0 * PI) * 180.0) as usize;
                (row.min(89) * 180 + column.min(179), distance)
            })
            .collect();
        let mut front = vec![f64::INFINITY; 90 * 180];
        for (pixel, distance) in &seen {
            front[*pixel] = front[*pixel].min(*distance);
        }
        let hidden =
            seen.iter().filter(|(pixel, distance)| *distance > 1.25 * front[*pixel] + 12.0 * self.unit).count();
        hidden as f64 / seen.len().max(1) as f64
    }
}

/// Walks to the best of six directions on ever smaller rings.
fn refine_direction(
    start: Vector3<f64>,
    start_cost: f64,
    mut cost: impl FnMut(&Vector3<f64>) -> f64,
) -> (f64, Vector3<f64>) {
    let mut best = (start_cost, start);
    for ring in RINGS {
        let centre = best.1;
        let aside = perpendicular(&centre);
        let up = centre.cross(&aside);
        for k in 0..6 {
            let angle = f64::from(k) * std::f64::consts::FRAC_PI_3;
            let direction = (centre + (aside * angle.cos() + up * angle.sin()) * ring).normalize();
            let trial = (cost(&direction), direction);
            if trial.0 < best.0 {
                best = trial;
            }
        }
    }
    best
}

/// `n` directions, evenly spread (a golden spiral).
fn sphere(n: usize) -> impl Iterator<Item = Vector3<f64>> {
    (0..n).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let angle = i as f64 * 2.399_963_229_728_653;
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

fn perpendicular(d: &Vector3<f64>) -> Vector3<f64> {
    let aside = if d.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    d.cross(&aside).normalize()
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
    use super::*;
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

    #[test]
    fn a_room_is_seen_from_within() {
        // The inside of a box of 6 by 4 by 3, seen by a scanner in it.
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
        assert!(view.kind == ViewKind::Near && !view.sure, "{view:?}");
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
