//! The cost of a viewpoint, given by edges whose normals it would turn apart, points that it could not have seen, and
//! how little the surface faces it; and the search for the viewpoint of least cost.

use super::dome::{self, look_around, sides_around};
use super::screen::{Columns, Screen, columns, face_along, project};
use crate::{Neighbor, NeighborIndex, Point, RadiusSearch, Spare, narrow, random::Stream, wide};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Number of directions on the sphere; half of them are tried, because an axis has no sign.
const DIRECTIONS: usize = 128;
/// Radii of the rings of refinement around the best directions, radians.
const RINGS: [f64; 3] = [0.14, 0.08, 0.04];
/// Distances of the near viewpoints from the cloud's middle, in multiples of its radius.
const NEAR_DISTANCES: [f64; 8] = [0.15, 0.35, 0.6, 0.9, 1.3, 1.8, 2.5, 4.0];
const NEAR_DIRECTIONS: usize = 48;
const NEAR_STEPS: usize = 80;
/// Weight of torn edges and hidden points against the logarithm of what the spacings leave unexplained.
const UNCLEAR: f64 = 8.0;
/// Maximum numbers of directions, of near viewpoints and of queried points that one thread takes at a time.
const DIRECTIONS_AT_A_TIME: usize = 2;
const VIEWPOINTS_AT_A_TIME: usize = 8;
const POINTS_AT_A_TIME: usize = 256;

/// Two neighbours whose normals are nearly parallel, and whether these point the same way as stored.
#[derive(Clone, Copy)]
struct Edge {
    ends: [u32; 2],
    aligned: bool,
}

/// Maximum length of an edge in units, and number of nearest points to which edges lead; every other point has its own
/// edges.
const EDGE_REACH: f64 = 5.0;
const EDGES: usize = 6;
/// Radius, in units, within which the convexity of a surface is measured.
const CONVEXITY_REACH: f64 = 8.0;
/// Stride of the points and edges by which directions are compared: every third suffices.
const STRIDE: usize = 3;

/// Points with unsigned normals, and what a viewpoint has to explain.
pub(super) struct Cloud<'a> {
    points: &'a [Point],
    normals: &'a [Point],
    index: &'a NeighborIndex,
    unit: f64,
    edges: Vec<Edge>,
    columns: Columns,
    normal_columns: Columns,
    /// Of every third point, position and normal.
    few: Columns,
    few_normals: Columns,
    /// n·p of every point.
    planes: Vec<f32>,
    pub(super) middle: Vector3<f64>,
    /// Distance of the farthest point from the middle.
    pub(super) radius: f64,
}

/// Buffers that a thread reuses from direction to direction.
#[derive(Default)]
struct Workplace {
    sides: Vec<u8>,
    cosines: Vec<f32>,
    pixels: Vec<u32>,
    depths: Vec<f32>,
    front: Vec<f32>,
}

impl Workplace {
    /// Makes room for these numbers of points and of normals.
    fn resize(&mut self, n_points: usize, n_normals: usize) {
        self.sides.resize(n_normals, 0);
        self.cosines.resize(n_points.max(n_normals), 0.0);
        self.pixels.resize(n_points, 0);
        self.depths.resize(n_points, 0.0);
    }

    /// Returns the fraction of the points for which `is_behind` holds of their depth and the least depth in their
    /// pixel.
    fn hidden(&mut self, n_pixels: usize, is_behind: impl Fn(f32, f32) -> bool) -> f64 {
        let Workplace { pixels, depths, front, .. } = self;
        front.clear();
        front.resize(n_pixels, f32::INFINITY);
        for (&pixel, &depth) in pixels.iter().zip(depths.iter()) {
            let at = &mut front[pixel as usize];
            *at = if depth < *at { depth } else { *at };
        }
        let seen = pixels.iter().zip(depths.iter());
        let hidden: u32 = seen.map(|(&pixel, &depth)| u32::from(is_behind(depth, front[pixel as usize]))).sum();
        f64::from(hidden) / pixels.len().max(1) as f64
    }
}

fn mean(values: &[f32]) -> f64 {
    values.iter().copied().map(f64::from).sum::<f64>() / values.len().max(1) as f64
}

impl<'a> Cloud<'a> {
    pub(super) fn new(points: &'a [Point], normals: &'a [Point], index: &'a NeighborIndex, unit: f64) -> Self {
        let middle = points.iter().map(|p| wide(*p)).sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let radius = points.iter().map(|p| (wide(*p) - middle).norm()).fold(0.0, f64::max);
        let search = RadiusSearch::among(points, index, EDGE_REACH * unit);
        let of_point = |near: &mut Vec<Neighbor>, i: usize| {
            // The point itself is one of them.
            search.nearest_n(&points[i], EDGES + 1, near);
            let edge = |n: &Neighbor| {
                let cosine = wide(normals[i]).dot(&wide(normals[n.index as usize]));
                (cosine.abs() > 0.7).then_some(Edge { ends: [i as u32, n.index], aligned: cosine > 0.0 })
            };
            let mut edges = [None; EDGES];
            let others = near.iter().filter(|n| n.index != i as u32);
            edges.iter_mut().zip(others).for_each(|(own, n)| *own = edge(n));
            edges
        };
        let some = (0..points.len()).into_par_iter().step_by(2).with_max_len(POINTS_AT_A_TIME);
        let edges: Vec<[Option<Edge>; EDGES]> = some.map_init(Vec::new, of_point).collect();
        let few = |all: &[Point]| columns(&all.iter().step_by(STRIDE).copied().collect::<Vec<_>>());
        Cloud {
            points,
            normals,
            index,
            unit,
            edges: edges.iter().flatten().flatten().copied().collect(),
            columns: columns(points),
            normal_columns: columns(normals),
            few: few(points),
            few_normals: few(normals),
            planes: points.iter().zip(normals).map(|(p, n)| wide(*p).dot(&wide(*n)) as f32).collect(),
            middle,
            radius,
        }
    }

    /// Returns the axis of least cost, with its fractions of torn edges and of hidden points.
    pub(super) fn best_axis(&self) -> (Vector3<f64>, f64, f64) {
        let spare = Spare::default();
        let cost = |d: &Vector3<f64>| {
            let (torn, hidden, facing) = spare.with(|workplace| self.axis_terms(workplace, d, &self.few, STRIDE));
            torn + hidden - 0.1 * facing
        };
        let candidates: Vec<Vector3<f64>> = sphere(DIRECTIONS).filter(|d| d.z >= 0.0).collect();
        let parts = candidates.par_iter().with_max_len(DIRECTIONS_AT_A_TIME);
        let found: Vec<f64> = parts.map(cost).collect();
        let mut costs: Vec<(f64, usize)> = found.into_iter().zip(0..).collect();
        costs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let refined: Vec<(f64, Vector3<f64>)> =
            costs.par_iter().take(3).map(|&(start, i)| refine_direction(candidates[i], start, cost)).collect();
        let (_, best) = refined.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or((0.0, Vector3::z()));
        let (torn, hidden, _) = spare.with(|workplace| self.axis_terms(workplace, &best, &self.columns, 1));
        (best, torn, hidden)
    }

    /// Returns, seen from far along `d`, the fractions of torn edges (of every `stride`-th) and hidden points (of
    /// `points`), and the mean |n·d|.
    fn axis_terms(
        &self,
        workplace: &mut Workplace,
        d: &Vector3<f64>,
        points: &Columns,
        stride: usize,
    ) -> (f64, f64, f64) {
        let n = self.normals.len();
        workplace.resize(points[0].len(), n);
        face_along(&self.normal_columns, narrow(d), &mut workplace.cosines, &mut workplace.sides);
        let torn = self.torn(stride, &workplace.sides);
        let facing = mean(&workplace.cosines[..n]);
        (torn, self.hidden_from_far(workplace, d, points), facing)
    }

    /// Returns the fraction of edges whose ends would be turned apart, given the side of each normal that a viewpoint
    /// is on.
    fn torn(&self, stride: usize, sides: &[u8]) -> f64 {
        let is_torn = |edge: &Edge| (sides[edge.ends[0] as usize] == sides[edge.ends[1] as usize]) != edge.aligned;
        let torn: u32 = self.edges.iter().step_by(stride).map(|edge| u32::from(is_torn(edge))).sum();
        f64::from(torn) / self.edges.len().div_ceil(stride).max(1) as f64
    }

    /// Returns the fraction of points more than 12 units behind the first of their pixel, seen from far along `d`.
    fn hidden_from_far(&self, workplace: &mut Workplace, d: &Vector3<f64>, points: &Columns) -> f64 {
        let right = perpendicular(d);
        let pixel = (4.0 * self.unit).max(self.radius / 1000.0);
        let width = (2.0 * self.radius / pixel) as usize + 2;
        let screen = Screen {
            axes: [right, d.cross(&right), -d].map(|axis| narrow(&axis)),
            middle: narrow(&self.middle),
            half: self.radius as f32,
            per_pixel: (1.0 / pixel) as f32,
            width: width as u32,
        };
        project(points, &screen, &mut workplace.pixels, &mut workplace.depths);
        let far = (12.0 * self.unit) as f32;
        workplace.hidden(width * width, |depth, front| depth > front + far)
    }

    /// Returns the mean of −(m·n)/8 units, where `m` is the mean offset of the neighbours: above zero for bulges.
    /// `keep` tells whether the stored normal of a point already points to the assumed side.
    pub(super) fn convexity(&self, keep: impl Fn(usize) -> bool + Sync) -> f64 {
        let reach = CONVEXITY_REACH * self.unit;
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
        let some = (0..self.points.len()).into_par_iter().step_by(4).with_max_len(POINTS_AT_A_TIME);
        let sampled: Vec<f64> = some.map(|i| if keep(i) { bulge(i) } else { -bulge(i) }).collect();
        sampled.iter().sum::<f64>() / sampled.len().max(1) as f64
    }

    /// Returns the mean convexity under signed normals, relative to the cloud's radius: a quarter for a sphere, about
    /// zero for a sheet.
    pub(super) fn bulge(&self, signed: &[Point]) -> f64 {
        let convexity = self.convexity(|i| wide(self.normals[i]).dot(&wide(signed[i])) > 0.0);
        convexity * self.radius / (CONVEXITY_REACH * self.unit)
    }

    /// Returns the near viewpoint of least cost, and its cost.
    pub(super) fn best_near(&self) -> (Vector3<f64>, f64) {
        let around = NEAR_DISTANCES.iter().flat_map(|z| sphere(NEAR_DIRECTIONS).map(move |d| d * *z));
        let candidates: Vec<Vector3<f64>> =
            std::iter::once(Vector3::zeros()).chain(around).map(|offset| self.middle + offset * self.radius).collect();
        let (mut best, mut cost) = self.least(&candidates, |workplace, viewpoint| self.near_cost(workplace, viewpoint));
        let mut workplace = Workplace::default();
        let mut step = 0.3 * (0.5 * self.radius).max((best - self.middle).norm());
        let mut stream = Stream::new(3, 0);
        for round in 1..=NEAR_STEPS {
            let trial = best + step * Vector3::from_fn(|_, _| stream.normal());
            let trial_cost = self.near_cost(&mut workplace, &trial);
            if trial_cost < cost {
                (best, cost) = (trial, trial_cost);
            } else if round % 20 == 0 {
                step *= 0.6;
            }
        }
        (best, cost)
    }

    /// Returns the viewpoint from which least is torn and hidden, given what else speaks against each; the first of
    /// equals. There must be one.
    pub(super) fn clearest(&self, viewpoints: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
        let cost = |workplace: &mut Workplace, (viewpoint, against): &(Vector3<f64>, f64)| {
            let (torn, hidden, _) = self.near_terms(workplace, viewpoint);
            against + UNCLEAR * (torn + hidden)
        };
        self.least(viewpoints, cost).0.0
    }

    /// Returns the viewpoint of least cost, the first of equals, and its cost; there must be one.
    fn least<V: Copy + Sync>(&self, viewpoints: &[V], cost: impl Fn(&mut Workplace, &V) -> f64 + Sync) -> (V, f64) {
        let spare = Spare::default();
        let cost_of = |viewpoint: &V| spare.with(|workplace| cost(workplace, viewpoint));
        let parts = viewpoints.par_iter().with_max_len(VIEWPOINTS_AT_A_TIME);
        let costs: Vec<f64> = parts.map(cost_of).collect();
        let first = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).expect("at least one viewpoint");
        (viewpoints[first], costs[first])
    }

    fn near_cost(&self, workplace: &mut Workplace, viewpoint: &Vector3<f64>) -> f64 {
        let (torn, hidden, facing) = self.near_terms(workplace, viewpoint);
        torn + 0.2 * hidden - 0.1 * facing
    }

    /// Returns, seen from a near viewpoint, the fractions of torn edges and of hidden points, and the mean |n·d|.
    fn near_terms(&self, workplace: &mut Workplace, viewpoint: &Vector3<f64>) -> (f64, f64, f64) {
        let (n, viewpoint) = (self.few[0].len(), narrow(viewpoint));
        workplace.resize(n, self.normals.len());
        let Workplace { sides, cosines, pixels, depths, .. } = workplace;
        sides_around(&self.normal_columns, &self.planes, viewpoint, sides);
        let torn = self.torn(2, sides);
        look_around(&self.few, &self.few_normals, viewpoint, pixels, depths, cosines);
        let facing = mean(&cosines[..n]);
        let far = (12.0 * self.unit) as f32;
        let hidden = workplace.hidden(dome::PIXELS, |distance, front| distance > 1.25 * front + far);
        (torn, hidden, facing)
    }
}

/// Moves to the best of six directions on ever smaller rings.
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

/// Returns `n` directions, evenly spread (a golden spiral).
pub(super) fn sphere(n: usize) -> impl Iterator<Item = Vector3<f64>> {
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
