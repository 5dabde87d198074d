//! The inputs of the stages, made once from one scan.

use congruent_descriptors::{Descriptor, Features, FpfhConfig, ShotConfig};
use congruent_estimators::{HypothesisGenerator, ThreePoint};
use congruent_geometry::{
    NeighborIndex, Neighborhood, Orientation, Point, RawScan, RigidTransform, Scan, Surface, estimate_normals, orient,
    resolution, voxel_centroids,
};
use congruent_io::{read_scan, write_ply};
use congruent_metrics::Evidence;
use congruent_simulation::correspondences::{CorrespondenceScene, NearMiss};
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::RangeNoise;
use nalgebra::Vector3;
use std::error::Error;
use std::path::{Path, PathBuf};

/// Image side that gives about 40 000 points.
const PIXELS: u32 = 420;
/// Standard deviation of the simulated ranges, data units: about a tenth of the distance between neighbours.
const NOISE: f64 = 0.02;
/// Number of points that are described at full density.
const KEYPOINTS: usize = 1000;
/// Maximum number of rows in each of the two tables of short descriptors.
const SHORT_ROWS: usize = 5000;
/// Number of neighbours from which a normal is estimated.
pub(crate) const NEIGHBORS: usize = 30;
/// Radius from which the normals of the thinned cloud are estimated, resolutions.
const THIN_NORMAL_RADIUS: f64 = 5.0;
/// Side of a cell of the thinning grid, resolutions.
pub(crate) const LEAF: f64 = 2.0;
/// Numbers of poses and of correspondences that are scored.
const POSES: u64 = 1000;
const CORRESPONDENCES: usize = 1000;
/// Number of correspondences whose compatibility graph is searched: as many as `default` keeps.
const GRAPH_CORRESPONDENCES: usize = 4000;

/// One scan and what was made from it.
pub(crate) struct Inputs {
    /// A binary PLY of the scan's distinct points, centred.
    pub(crate) file: PathBuf,
    /// The contents of the file.
    pub(crate) raw: RawScan,
    /// The scan, with normals from `NEIGHBORS` neighbours.
    pub(crate) surface: Surface,
    /// The centroids of the scan on a grid of `LEAF`, with normals.
    pub(crate) thinned: Surface,
    /// Points of `surface` to be described, spread evenly over its order.
    pub(crate) keypoints: Vec<u32>,
    /// Two tables of SHOT rows, of different points.
    pub(crate) long: [Features; 2],
    /// Two tables of FPFH rows, of different points of the thinned cloud.
    pub(crate) short: [Features; 2],
    /// Simulated correspondences, a fifth of them right.
    pub(crate) evidence: Evidence,
    /// More of the same, as many as a compatibility graph is made from.
    pub(crate) graph_evidence: Evidence,
    /// Poses from three correspondences of `evidence` each.
    pub(crate) poses: Vec<RigidTransform>,
    /// The points of the scan at even positions …
    pub(crate) moving: Surface,
    /// … and those at odd positions.
    pub(crate) fixed: Surface,
}

impl Inputs {
    /// Makes the inputs from a scan file, or from a simulated scan; the PLY is written to `folder`.
    pub(crate) fn new(scan: Option<&Path>, folder: &Path) -> Result<Inputs, Box<dyn Error>> {
        let given = match scan {
            Some(path) => read_scan(path)?,
            None => simulated(),
        };
        let file = folder.join("scan.ply");
        let distinct = Scan::new(&given)?.points().to_vec();
        write_ply(&file, &distinct.into(), None, &[])?;
        let raw = read_scan(&file)?;
        let points = Scan::new(&raw)?.points().to_vec();

        let surface = surface(points.clone(), Neighborhood::Nearest(NEIGHBORS))?;
        let pr = surface.resolution();
        let thin = voxel_centroids(&points, None, LEAF * pr).points;
        let thinned = surface_of(thin, Neighborhood::Radius(THIN_NORMAL_RADIUS * pr), pr);
        let keypoints = spread(surface.len(), KEYPOINTS, 0);
        let others = spread(surface.len(), KEYPOINTS, surface.len() / (2 * KEYPOINTS));
        let shot = ShotConfig::default().build(pr);
        let long = [&keypoints, &others].map(|rows| shot.describe(&surface, rows));
        let fpfh = FpfhConfig::default().build(pr);
        let short = [0, 1].map(|first| {
            let rows: Vec<u32> = (first..thinned.len() as u32).step_by(2).take(SHORT_ROWS).collect();
            fpfh.describe(&thinned, &rows)
        });
        let evidence = pairs(CORRESPONDENCES);
        let proposals = ThreePoint::new(&evidence, POSES, 1);
        let poses = (0..POSES).filter_map(|trial| proposals.propose(trial)).collect();
        let [moving, fixed] = halves(&surface)?;
        let graph_evidence = pairs(GRAPH_CORRESPONDENCES);
        Ok(Inputs {
            file,
            raw,
            surface,
            thinned,
            keypoints,
            long,
            short,
            evidence,
            graph_evidence,
            poses,
            moving,
            fixed,
        })
    }

    /// Returns the mean distance of a point to its nearest other point, data units.
    pub(crate) fn pr(&self) -> f64 {
        self.surface.resolution()
    }
}

/// A simulated scan of the figurine.
fn simulated() -> RawScan {
    let options = PairOptions { pixels: PIXELS, noise: RangeNoise::gaussian(NOISE), ..PairOptions::default() };
    figurine_pair(&options).source
}

fn surface(points: Vec<Point>, neighborhood: Neighborhood) -> Result<Surface, Box<dyn Error>> {
    let pr = resolution(&points, &NeighborIndex::new(&points)).ok_or("a scan of two points at least")?.mean;
    Ok(surface_of(points, neighborhood, pr))
}

fn surface_of(points: Vec<Point>, neighborhood: Neighborhood, pr: f64) -> Surface {
    let index = NeighborIndex::new(&points);
    let mut normals: Vec<Point> = estimate_normals(&points, &index, neighborhood).iter().map(|n| n.normal).collect();
    orient(Orientation::Estimated {}, &points, &Vector3::zeros(), &index, pr, None, &mut normals);
    Surface::new(points, normals, index, pr)
}

/// Returns `count` positions of `n`, evenly spaced, from `first` on.
fn spread(n: usize, count: usize, first: usize) -> Vec<u32> {
    (first..n).step_by((n / count).max(1)).take(count).map(|i| i as u32).collect()
}

fn pairs(n: usize) -> Evidence {
    let scene = CorrespondenceScene { n, inlier_share: 0.2, near_miss_share: 0.2, near_miss: NearMiss::Random };
    let made = scene.generate(1);
    Evidence::new(made.source.into_iter().zip(made.target))
}

/// Splits the points into those at even and those at odd positions.
fn halves(whole: &Surface) -> Result<[Surface; 2], Box<dyn Error>> {
    let half = |first: usize| {
        let points = whole.points().iter().copied().skip(first).step_by(2).collect();
        surface(points, Neighborhood::Nearest(NEIGHBORS))
    };
    Ok([half(0)?, half(1)?])
}
