//! Virtual scans: with exact truth, of objects that are merely similar, and of shapes that do not determine the pose.

use super::{Scene, Trial};
use congruent_evaluation::calibration::Origin;
use congruent_pipeline::Pair;
use congruent_simulation::Mesh;
use congruent_simulation::ambiguous::{Subject, ambiguous_pair};
use congruent_simulation::benchmark::{Benchmark, Group, Kind};
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::{RangeNoise, VirtualScanner};
use congruent_simulation::shapes::figurine;
use std::f64::consts::PI;
use std::sync::Arc;

const KINDS: [(&str, Kind); 4] =
    [("u3m-like", Kind::U3m), ("bmr-like", Kind::Bmr), ("u3or-like", Kind::U3or), ("bod5-like", Kind::Bod5)];
/// Maximum number of pairs taken from one group of a benchmark, evenly, so that many shapes take part.
const PER_GROUP: usize = 4;
/// Factors along the three axes; each of them turns a figurine into another object.
const STRETCHES: [[f64; 3]; 3] = [[1.7, 0.7, 0.8], [0.8, 1.5, 0.8], [0.75, 0.75, 1.6]];
/// Position of the scanners: elevation in radians, and distance in radii of the object.
const ELEVATION: f64 = 0.25;
const DISTANCE_FACTOR: f64 = 3.5;
/// Angle between the views of two similar objects, radians; multiplied by 0 to 4.
const TURN: f64 = 0.35;
/// Range of the angle between views of a figurine from opposite sides, radians: they share its outline at most.
const OPPOSITE: [f64; 2] = [2.4, PI];

/// Returns `n` pairs of each kind of benchmark, as many pairs of views that hardly overlap, and as many pairs of each
/// way in which two objects are similar.
pub(super) fn trials<'a>(n: usize, seed: u64) -> Vec<Trial<'a>> {
    let mut trials: Vec<Trial<'a>> = KINDS.iter().flat_map(|&(name, kind)| benchmark(name, kind, n, seed)).collect();
    trials.extend((0..n as u64).map(|number| opposite(number, seed)));
    let relatives = [Relative::Stretched, Relative::Sibling];
    trials
        .extend(relatives.iter().flat_map(|&relative| (0..n as u64).map(move |number| alike(relative, number, seed))));
    trials
}

/// Returns `n` pairs of each shape that does not determine the pose.
pub(super) fn open_trials<'a>(n: usize) -> Vec<Trial<'a>> {
    let all = Subject::ALL.iter().flat_map(|&subject| (0..n as u64).map(move |variant| (subject, variant)));
    all.map(|(subject, variant)| {
        let id = format!("open/{subject:?}-{variant}").to_lowercase();
        let scene = move || {
            let [source, target] = ambiguous_pair(subject, variant);
            Ok(Scene { scans: Pair { source, target }, target_from_source: None })
        };
        Trial { groups: vec![id.clone()], id, origin: Origin::Open, scene: Box::new(scene) }
    })
    .collect()
}

fn benchmark<'a>(name: &str, kind: Kind, n: usize, seed: u64) -> Vec<Trial<'a>> {
    let benchmark = Benchmark::new(kind, seed);
    let mut trials = Vec::new();
    for number in 0..n.div_ceil(PER_GROUP) as u64 {
        let group = Arc::new(benchmark.group(number));
        let stride = group.pairs.len().div_ceil(PER_GROUP).max(1);
        for place in (0..group.pairs.len()).step_by(stride) {
            let id = format!("simulated/{name}/{number}-{place}");
            let group = Arc::clone(&group);
            let scene = Box::new(move || Ok(scene(&group, place)));
            trials.push(Trial { id, groups: vec![format!("{name}/{number}")], origin: Origin::Simulated, scene });
        }
    }
    trials.truncate(n);
    trials
}

fn scene(group: &Group, place: usize) -> Scene {
    let pair = &group.pairs[place];
    let [source, target] = [pair.source, pair.target].map(|i| group.scans[i].1.clone());
    Scene { scans: Pair { source, target }, target_from_source: Some(pair.target_from_source) }
}

fn opposite<'a>(number: u64, seed: u64) -> Trial<'a> {
    let id = format!("simulated/opposite/{number}");
    let share = (number % 8) as f64 / 7.0;
    let scene = move || {
        let pair = figurine_pair(&PairOptions {
            seed: seed.wrapping_add(1000 + number),
            azimuth: number as f64,
            view_angle: OPPOSITE[0] + share * (OPPOSITE[1] - OPPOSITE[0]),
            pixels: 240,
            noise: RangeNoise::gaussian(0.04),
        });
        let scans = Pair { source: pair.source, target: pair.target };
        Ok(Scene { scans, target_from_source: Some(pair.target_from_source) })
    };
    Trial { groups: vec![id.clone()], id, origin: Origin::Simulated, scene: Box::new(scene) }
}

/// How another object resembles a figurine.
#[derive(Clone, Copy, Debug)]
enum Relative {
    /// It is the same object, but longer along one axis and shorter along the others.
    Stretched,
    /// It is made of the same parts, in other places and of other sizes.
    Sibling,
}

/// Scans two objects that have much in common, with images of small to medium size.
fn alike<'a>(relative: Relative, number: u64, seed: u64) -> Trial<'a> {
    let id = format!("alike/{relative:?}-{number}").to_lowercase();
    let scene = move || {
        let seed = seed.wrapping_add(2000 + number);
        let object = figurine(seed);
        let other = match relative {
            Relative::Stretched => stretched(&object, STRETCHES[number as usize % STRETCHES.len()]),
            Relative::Sibling => figurine(seed.wrapping_add(500)),
        };
        let pixels = 100 + 70 * (number % 3) as u32;
        let noise = RangeNoise::gaussian(0.02 * (number % 4) as f64);
        let look = |mesh: &Mesh, azimuth: f64, seed: u64| {
            VirtualScanner { noise, ..VirtualScanner::orbit(mesh, azimuth, ELEVATION, DISTANCE_FACTOR, pixels) }
                .scan(mesh, seed)
                .cloud()
        };
        let azimuth = number as f64;
        let scans = Pair {
            source: look(&object, azimuth, 2 * seed),
            target: look(&other, azimuth + TURN * (number % 5) as f64, 2 * seed + 1),
        };
        Ok(Scene { scans, target_from_source: None })
    };
    Trial { groups: vec![id.clone()], id, origin: Origin::Crossed, scene: Box::new(scene) }
}

fn stretched(object: &Mesh, factors: [f64; 3]) -> Mesh {
    let mut mesh = object.clone();
    mesh.points.iter_mut().for_each(|p| (0..3).for_each(|axis| p[axis] *= factors[axis]));
    mesh
}
