//! Data sets resembling the four that registration papers use, with exact ground truth.
//!
//! A benchmark is a sequence of groups: a few scans and the pairs among them. Group *g* depends only on the kind, the
//! seed and *g*, so a longer benchmark begins with the shorter one.

use crate::Mesh;
use crate::nuisances::cut_holes;
use crate::pair::overlap;
use crate::scanner::{RangeNoise, RangeScan, VirtualScanner};
use crate::shapes::{FIGURINE_HEIGHT, figurine, plane};
use congruent_geometry::random::Stream;
use congruent_geometry::{NeighborIndex, Point, RawScan, RigidTransform, narrow, resolution};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Number of views of one figurine in a group.
const VIEWS: u64 = 8;
/// Number of figurines from which scenes are made, as many as U3OR has models.
const MODELS: u64 = 5;
/// Number of those in a scene.
const IN_SCENE: usize = 4;
/// Minimum overlap of the listed pairs of views: the usual choice for U3M.
const MIN_OVERLAP: f64 = 0.1;
/// Distance within which points are shared, in resolutions: the evaluation's own rule.
const SHARED_WITHIN_PR: f64 = 4.0;
/// Image sides for one figurine and for a scene, by laser (25 000 points or more, as in U3M) and by Kinect.
const LASER_PIXELS: [u32; 2] = [320, 480];
const KINECT_PIXELS: [u32; 2] = [140, 320];
/// Laser noise, figurine units (hundredths of its height).
const LASER_SIGMA: f64 = 0.04;
/// Growth of a Kinect's noise with the square of the range; at a figurine's distance the noise is about half a
/// resolution.
const KINECT_GROWTH: f64 = 6e-6;
/// Step of a Kinect's ranges.
const KINECT_STEP: f64 = 0.25;
/// Number of holes where a Kinect sees nothing.
const KINECT_HOLES: usize = 6;
/// Distance of the sensor in radii of its subject: a figurine, a scene.
const DISTANCE_FACTORS: [f64; 2] = [3.5, 2.0];
/// Radius of the circle on which a scene's figurines stand.
const SCENE_RADIUS: f64 = 62.0;
/// Side of the table on which they stand.
const TABLE_SIZE: f64 = 260.0;

/// The data set to resemble.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Laser scans of one object from all around: limited overlap, self-occlusion, little noise.
    U3m,
    /// Kinect images of one object: noise that grows with the range, quantised ranges, holes.
    Bmr,
    /// Whole models in cluttered laser scans of several objects.
    U3or,
    /// Kinect images of single objects in cluttered Kinect images of several.
    Bod5,
}

/// A few scans and the pairs among them.
#[derive(Clone, Debug)]
pub struct Group {
    /// The scans with their names, which are unique in the benchmark.
    pub scans: Vec<(String, RawScan)>,
    /// Pairs of positions in `scans`.
    pub pairs: Vec<GroupPair>,
}

/// Two scans and their true pose.
#[derive(Clone, Debug)]
pub struct GroupPair {
    /// Position of the scan to be moved.
    pub source: usize,
    /// Position of the scan that stays.
    pub target: usize,
    /// True pose, exact up to rounding in `f64`.
    pub target_from_source: RigidTransform,
    /// Fraction of points within four resolutions of the other scan: for views the smaller one of both directions, for
    /// scenes that of the source's points.
    pub overlap: f64,
}

/// A data set that is generated group by group.
pub struct Benchmark {
    kind: Kind,
    seed: u64,
    /// Models of the scenes; empty for the other kinds.
    models: Vec<Mesh>,
    /// Shapes that are scanned instead of figurines, if any.
    shapes: Vec<Mesh>,
}

/// What a sensor looks at.
#[derive(Clone, Copy)]
enum Subject {
    Figurine,
    Scene,
}

/// A scan with its true pose.
struct Look {
    name: String,
    scan: RawScan,
    world_from_scan: RigidTransform,
}

impl Benchmark {
    /// Prepares what all groups share.
    #[must_use]
    pub fn new(kind: Kind, seed: u64) -> Self {
        Benchmark::of_shapes(kind, seed, Vec::new())
    }

    /// Prepares a benchmark of other shapes than figurines, taken in turn: scaled to the size of a figurine and
    /// centred. Shapes without an extent are left out; if none is left, figurines are scanned.
    #[must_use]
    pub fn of_shapes(kind: Kind, seed: u64, shapes: Vec<Mesh>) -> Self {
        let shapes: Vec<Mesh> = shapes.into_iter().filter_map(|mesh| mesh.fitted(FIGURINE_HEIGHT)).collect();
        let n_models = if kind.has_scenes() { MODELS } else { 0 };
        let models = (0..n_models).into_par_iter().map(|model| shape(&shapes, seed, model)).collect();
        Benchmark { kind, seed, models, shapes }
    }

    /// Returns the scans and pairs of one group. Few groups have no pairs.
    #[must_use]
    pub fn group(&self, group: u64) -> Group {
        if self.kind.has_scenes() { self.scene(group) } else { self.views(group) }
    }

    /// Returns one figurine from several sides.
    fn views(&self, group: u64) -> Group {
        let mesh = shape(&self.shapes, self.seed, group);
        let looks: Vec<Look> = (0..VIEWS)
            .into_par_iter()
            .map(|view| {
                let item = group * VIEWS + view;
                let mut stream = Stream::new(self.seed, item);
                // All around, but not evenly, and from slightly below to well above.
                let azimuth = TAU * (view as f64 + stream.between(-0.35, 0.35)) / VIEWS as f64;
                let elevation = stream.between(-0.15, 0.7);
                self.look(&mesh, [azimuth, elevation], Subject::Figurine, item, format!("g{group:03}_v{view}.ply"))
            })
            .collect();
        let candidates: Vec<(usize, usize)> =
            (0..looks.len()).flat_map(|target| (target + 1..looks.len()).map(move |source| (source, target))).collect();
        let pairs: Vec<GroupPair> = candidates
            .par_iter()
            .map(|&(source, target)| pair(&looks, source, target, Direction::Both))
            .filter(|pair| pair.overlap >= MIN_OVERLAP)
            .collect();
        Group { scans: looks.into_iter().map(|look| (look.name, look.scan)).collect(), pairs }
    }

    /// Returns several figurines on a table, and each of them by itself.
    fn scene(&self, group: u64) -> Group {
        let mut stream = Stream::new(self.seed, group);
        let absent = group as usize % self.models.len();
        let present: Vec<usize> = (0..self.models.len()).filter(|m| *m != absent).take(IN_SCENE).collect();
        let mut mesh = plane(TABLE_SIZE, 40);
        mesh.points.iter_mut().for_each(|p| p[2] -= FIGURINE_HEIGHT / 2.0);
        let mut places = Vec::new();
        let start = stream.between(0.0, TAU);
        for (i, &model) in present.iter().enumerate() {
            let angle = start + TAU * i as f64 / present.len() as f64;
            let radius = SCENE_RADIUS * stream.between(0.75, 1.0);
            let at = Translation3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), stream.between(0.0, TAU));
            let place = RigidTransform::from_parts(at, turn);
            mesh.append(&placed(&self.models[model], &place));
            places.push(place);
        }
        let (azimuth, elevation) = (stream.between(0.0, TAU), stream.between(0.35, 0.75));
        let item = u64::MAX / 2 + group;
        let scene = self.look(&mesh, [azimuth, elevation], Subject::Scene, item, format!("scene{group:03}.ply"));
        let mut looks = vec![scene];
        for (&model, place) in present.iter().zip(&places) {
            let mut look = self.model(group, model, &mut stream);
            look.world_from_scan = place * look.world_from_scan;
            looks.push(look);
        }
        let pairs = (1..looks.len()).map(|source| pair(&looks, source, 0, Direction::SourceAlone)).collect();
        Group { scans: looks.into_iter().map(|look| (look.name, look.scan)).collect(), pairs }
    }

    /// Returns a figurine by itself, in its own frame: the whole surface, or one image of it.
    fn model(&self, group: u64, model: usize, stream: &mut Stream) -> Look {
        let mesh = &self.models[model];
        if self.kind == Kind::U3or {
            let scan = RawScan { points: mesh.points.clone().into(), ..RawScan::default() };
            return Look { name: format!("model{model}.ply"), scan, world_from_scan: RigidTransform::identity() };
        }
        let (azimuth, elevation) = (stream.between(0.0, TAU), stream.between(0.0, 0.6));
        let item = u64::MAX / 4 + group * MODELS + model as u64;
        self.look(mesh, [azimuth, elevation], Subject::Figurine, item, format!("model{model}_{group:03}.ply"))
    }

    fn look(&self, mesh: &Mesh, [azimuth, elevation]: [f64; 2], subject: Subject, item: u64, name: String) -> Look {
        let orbit = VirtualScanner::orbit(
            mesh,
            azimuth,
            elevation,
            DISTANCE_FACTORS[subject as usize],
            self.kind.pixels()[subject as usize],
        );
        let scanner = VirtualScanner { noise: self.kind.noise(), ..orbit };
        let seed = Stream::new(self.seed, item).below(u32::MAX).into();
        let RangeScan { points, world_from_sensor, .. } = scanner.scan(mesh, seed);
        let scan = RawScan { points: points.into(), ..RawScan::default() };
        let scan = if self.kind.is_kinect() { cut_holes(&scan, KINECT_HOLES, seed) } else { scan };
        Look { name, scan, world_from_scan: world_from_sensor }
    }
}

impl Kind {
    fn has_scenes(self) -> bool {
        matches!(self, Kind::U3or | Kind::Bod5)
    }

    fn is_kinect(self) -> bool {
        matches!(self, Kind::Bmr | Kind::Bod5)
    }

    fn pixels(self) -> [u32; 2] {
        if self.is_kinect() { KINECT_PIXELS } else { LASER_PIXELS }
    }

    fn noise(self) -> RangeNoise {
        if self.is_kinect() {
            RangeNoise { sigma: 0.0, growth: KINECT_GROWTH, step: KINECT_STEP }
        } else {
            RangeNoise::gaussian(LASER_SIGMA)
        }
    }
}

/// Returns the seed of a shape; streams of shapes and of views must not coincide.
fn shape_seed(seed: u64, shape: u64) -> u64 {
    seed.wrapping_mul(1_000_003).wrapping_add(shape)
}

/// Returns one of the given shapes, or a figurine if there are none.
fn shape(shapes: &[Mesh], seed: u64, number: u64) -> Mesh {
    match shapes {
        [] => figurine(shape_seed(seed, number)),
        some => some[number as usize % some.len()].clone(),
    }
}

fn placed(mesh: &Mesh, place: &RigidTransform) -> Mesh {
    let points = mesh.points.iter().map(|&p| (place * Point3::from(p)).into()).collect();
    Mesh { points, triangles: mesh.triangles.clone() }
}

/// Whose points count for the overlap.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Both,
    SourceAlone,
}

fn pair(looks: &[Look], source: usize, target: usize, direction: Direction) -> GroupPair {
    let (s, t) = (&looks[source], &looks[target]);
    let target_from_source = t.world_from_scan.inverse() * s.world_from_scan;
    let radius = SHARED_WITHIN_PR * f64::midpoint(spacing(&s.scan), spacing(&t.scan));
    let forth = overlap(&s.scan, &t.scan, &target_from_source, radius);
    let shared = match direction {
        Direction::SourceAlone => forth,
        Direction::Both => forth.min(overlap(&t.scan, &s.scan, &target_from_source.inverse(), radius)),
    };
    GroupPair { source, target, target_from_source, overlap: shared }
}

/// Returns the mean distance between neighbouring points; zero for fewer than two.
fn spacing(scan: &RawScan) -> f64 {
    let points: Vec<Point> = scan.points.iter().map(|p| narrow(&p.into())).collect();
    resolution(&points, &NeighborIndex::new(&points)).map_or(0.0, |r| r.mean)
}

#[cfg(test)]
mod tests;
