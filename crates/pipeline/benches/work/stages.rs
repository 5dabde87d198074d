//! One function per stage. The input of a stage is made beforehand and not timed.

use super::Inputs;
use super::inputs::{LEAF, NEIGHBORS};
use congruent_descriptors::{Descriptor, FpfhConfig, ShotConfig, SpinImageConfig};
use congruent_estimators::{Compatibility, Graph, Pivots, ThreePoint, sample};
use congruent_geometry::{
    Length, NeighborIndex, Neighborhood, OrderedPoints, Orientation, Point, RigidTransform, Scan, estimate_normals,
    fit_three, orient, resolution, voxel_centroids,
};
use congruent_io::read_scan;
use congruent_keypoints::{Detector, HarrisConfig, IssConfig};
use congruent_matching::nearest_k;
use congruent_metrics::{InlierCount, Metric, Summed};
use congruent_refinement::{Freedom, Gicp, PointToPlane, Refiner, Schedule};
use multiversion::multiversion;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::fmt;

/// Number of three-point fits.
const FITS: usize = 100_000;
/// Number of trials of RANSAC.
const TRIALS: u64 = 10_000;
/// Residual below which simulated correspondences, whose resolution is 1, are inliers.
const THRESHOLD: f64 = 7.5;
/// Number of iterations of ICP, however early it converges.
const ICP_ITERATIONS: usize = 20;
/// Variance of a disc along its normal, as in small_gicp.
const FLATNESS: f64 = 1e-3;
/// The compatibility graph of `default`, for resolution 1.
const COMPATIBLE: Compatibility = Compatibility { tolerance: 4.0, min_distance: 8.0, max_angle: 0.45, max_cosine: 0.4 };
/// Operations that a register of pairs needs to be scored: 12 products, 12 sums and differences, a comparison, a choice
/// and the sum of the gains.
const OPERATIONS: usize = 27;
/// Numbers in a register.
const LANES: usize = 16;
/// Number of products, and of sums, that are computed side by side: enough that none waits for its predecessor.
const CHAINS: usize = 4;
/// Number of pivots of `default`.
const PIVOTS: usize = 8000;

/// A stage to be timed.
pub(crate) struct Stage {
    /// Its name, which the programs compared also use.
    pub(crate) name: &'static str,
    /// Runs the stage and returns the number of results.
    pub(crate) run: fn(&Inputs) -> usize,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// All stages, in the order of the chain.
pub(crate) const STAGES: &[Stage] = &[
    Stage { name: "read-ply", run: |i| read_scan(&i.file).map_or(0, |scan| scan.points.len()) },
    Stage { name: "clean", run: |i| Scan::new(&i.raw).map_or(0, |scan| scan.points().len()) },
    Stage { name: "index", run: |i| NeighborIndex::new(i.surface.points()).len() },
    Stage { name: "index-grid", run: |i| OrderedPoints::new(i.surface.points(), LEAF * i.pr()).cells().order().len() },
    Stage { name: "resolution", run: |i| resolution(i.surface.points(), i.surface.index()).iter().count() },
    Stage { name: "voxel-grid", run: |i| voxel_centroids(i.surface.points(), None, LEAF * i.pr()).points.len() },
    Stage { name: "normals", run: normals },
    Stage { name: "orientation", run: orientation },
    Stage { name: "iss", run: iss },
    Stage { name: "harris-3pr", run: |i| harris(i, 3.0) },
    Stage { name: "harris-5pr", run: |i| harris(i, 5.0) },
    Stage { name: "harris-7pr", run: |i| harris(i, 7.0) },
    Stage { name: "shot", run: |i| ShotConfig::default().build(i.pr()).describe(&i.surface, &i.keypoints).len() },
    Stage {
        name: "spin-image",
        run: |i| SpinImageConfig::default().build(i.pr()).describe(&i.surface, &i.keypoints).len(),
    },
    Stage { name: "fpfh", run: fpfh },
    Stage { name: "match-352", run: |i| nearest_k(&i.long[0], &i.long[1], 2).len() },
    Stage { name: "match-33", run: |i| nearest_k(&i.short[0], &i.short[1], 2).len() },
    Stage { name: "score", run: score },
    Stage { name: "arithmetic", run: arithmetic },
    Stage { name: "fit-three", run: fits },
    Stage { name: "ransac", run: ransac },
    Stage { name: "pivots", run: pivots },
    Stage { name: "icp-plane", run: |i| refined(i, |schedule| Box::new(PointToPlane { schedule })) },
    Stage { name: "gicp", run: |i| refined(i, |schedule| Box::new(Gicp { schedule, flatness: FLATNESS })) },
];

fn normals(inputs: &Inputs) -> usize {
    let surface = &inputs.surface;
    estimate_normals(surface.points(), surface.index(), Neighborhood::Nearest(NEIGHBORS)).len()
}

fn orientation(inputs: &Inputs) -> usize {
    let surface = &inputs.thinned;
    let mut normals: Vec<Point> = surface.normals().to_vec();
    let (origin, pr) = (Vector3::zeros(), surface.resolution());
    orient(Orientation::Estimated {}, surface.points(), &origin, surface.index(), pr, None, &mut normals);
    normals.len()
}

/// Uses the default radii of Open3D.
fn iss(inputs: &Inputs) -> usize {
    let config = IssConfig {
        salient_radius: Length::Resolutions(6.0),
        suppression_radius: Length::Resolutions(4.0),
        ..IssConfig::default()
    };
    config.build(inputs.pr()).detect(&inputs.surface).len()
}

fn harris(inputs: &Inputs, radius: f64) -> usize {
    let config = HarrisConfig { radius: Length::Resolutions(radius), ..HarrisConfig::default() };
    config.build(inputs.pr()).detect(&inputs.surface).len()
}

/// Describes all points of the thinned cloud.
fn fpfh(inputs: &Inputs) -> usize {
    let all: Vec<u32> = (0..inputs.thinned.len() as u32).collect();
    FpfhConfig::default().build(inputs.pr()).describe(&inputs.thinned, &all).len()
}

/// Runs on one thread: elsewhere the loop over the poses is what runs in parallel.
fn score(inputs: &Inputs) -> usize {
    let metric = Summed(InlierCount::new(THRESHOLD));
    let inliers = |pose: &RigidTransform| metric.score(&inputs.evidence, pose).value() as usize;
    inputs.poses.iter().map(inliers).sum()
}

/// As many operations as scoring needs, in registers alone: nothing that computes it as defined can be faster.
fn arithmetic(inputs: &Inputs) -> usize {
    let n_registers = inputs.poses.len() * inputs.evidence.len().div_ceil(LANES);
    let n_rounds = n_registers * OPERATIONS / (2 * CHAINS);
    let mut made = Chains::default();
    in_registers(n_rounds, std::hint::black_box([0.999, 0.001]), &mut made);
    n_rounds + usize::from(made.sums[0][0] < 0.0)
}

/// Numbers that depend on nothing but their own predecessors.
#[derive(Default)]
struct Chains {
    products: [[f32; LANES]; CHAINS],
    sums: [[f32; LANES]; CHAINS],
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn in_registers(n_rounds: usize, [factor, term]: [f32; 2], made: &mut Chains) {
    let Chains { mut products, mut sums } = *made;
    for _ in 0..n_rounds {
        for chain in 0..CHAINS {
            for lane in 0..LANES {
                products[chain][lane] *= factor;
                sums[chain][lane] += term;
            }
        }
    }
    *made = Chains { products, sums };
}

/// Runs on one thread.
fn fits(inputs: &Inputs) -> usize {
    let evidence = &inputs.evidence;
    let n = evidence.len();
    let three = |i: usize| [i % n, (7 * i + 1) % n, (13 * i + 5) % n];
    (0..FITS)
        .filter(|&i| fit_three(&three(i).map(|i| evidence.source(i)), &three(i).map(|i| evidence.target(i))).is_some())
        .count()
}

fn ransac(inputs: &Inputs) -> usize {
    let generator = ThreePoint::new(&inputs.evidence, TRIALS, 1);
    sample(&generator, &Summed(InlierCount::new(THRESHOLD)), &inputs.evidence, 1).len()
}

fn pivots(inputs: &Inputs) -> usize {
    let graph = Graph::new(&inputs.graph_evidence, &COMPATIBLE);
    let generator = Pivots::new(Cow::Borrowed(&inputs.graph_evidence), &graph, PIVOTS);
    sample(&generator, &Summed(InlierCount::new(THRESHOLD)), &inputs.graph_evidence, 1).len()
}

/// Aligns the two halves of the scan, from a start that is a little off, and returns the number of touching pairs.
fn refined(inputs: &Inputs, refiner: fn(Schedule) -> Box<dyn Refiner>) -> usize {
    let pr = inputs.pr();
    let schedule = Schedule {
        start_radius: 6.0 * pr,
        end_radius: 6.0 * pr,
        rounds: ICP_ITERATIONS,
        max_points: usize::MAX,
        min_normal_cosine: -1.0,
        scale: 3.0 * pr,
        tolerance: 0.0,
        freedom: Freedom::All,
    };
    let start = RigidTransform::new(Vector3::new(2.0 * pr, -pr, pr), Vector3::new(0.01, -0.02, 0.01));
    refiner(schedule).refine(&inputs.moving, &inputs.fixed, &start).n_pairs
}
