//! From a scan to a surface: thinned, with normals.

use crate::config::{BudgetConfig, NeighborhoodConfig};
use crate::{Failure, NormalSource, NormalsConfig, SamplingConfig, Strays};
use congruent_geometry::{
    NeighborIndex, Neighborhood, Orientation, Oriented, Point, Resolution, Sample, Scan, Surface, estimate_normals,
    orient, resolution, resolution_at, resolution_sampled, vertex_normals, voxel_centroids, voxel_count,
    without_strays,
};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Fewest neighbours that a normal is estimated from, where a radius finds fewer.
const MIN_NEIGHBORS: usize = 6;
/// Points at which a resolution is estimated (it is then good to about one per cent).
const ESTIMATE_AT: usize = 4000;
/// A grid that leaves too many points is enlarged by at least this factor …
const MIN_GROWTH: f64 = 1.02;
/// … and by this share of what would be enough if the scan were an even sheet.
const CAUTION: f64 = 0.97;

/// Thinned scans and the lengths that go with them, data units.
pub(crate) struct Sampled {
    pub(crate) clouds: Vec<Cloud>,
    /// How many points of each were left out because they hang alone.
    pub(crate) strays: Vec<usize>,
    /// Mean resolution of the scans as they came, without strays.
    pub(crate) raw_resolution: f64,
    /// What `pr` means from here on.
    pub(crate) resolution: f64,
}

/// A thinned scan.
pub(crate) struct Cloud {
    sample: Sample,
    origin: Vector3<f64>,
    /// Where the scanner stood, if that is known; centred.
    viewpoint: Option<Vector3<f64>>,
    index: NeighborIndex,
    resolution: f64,
}

/// A scan that is to be thinned.
struct Measured<'a> {
    /// Another one where strays were left out.
    scan: Cow<'a, Scan>,
    resolution: f64,
}

/// Thins all scans with the same grid.
pub(crate) fn sample(scans: &[&Scan], config: &SamplingConfig, normals: NormalSource) -> Result<Sampled, Failure> {
    // The paper's chain measures every point; a budget only needs to know where to start.
    let (queries, strays) = match config {
        SamplingConfig::Budget(budget) => (ESTIMATE_AT, budget.strays),
        SamplingConfig::None {} | SamplingConfig::VoxelGrid(_) => (usize::MAX, Strays::Kept),
    };
    let measured = each(scans, |scan| Measured::new(scan, queries, strays));
    let strays =
        scans.iter().zip(&measured).map(|(scan, left)| scan.points().len() - left.scan.points().len()).collect();
    let raw_resolution = mean(&measured.iter().map(|measured| measured.resolution).collect::<Vec<_>>());
    let scans = &measured.iter().map(|measured| measured.scan.as_ref()).collect::<Vec<&Scan>>();
    let given = given_by_all(scans, normals);
    let with_normals: Vec<(&Scan, Option<Vec<Point>>)> = scans.iter().copied().zip(given).collect();
    let thin = |leaf: f64| each(&with_normals, |(scan, given)| voxel_centroids(scan.points(), given.as_deref(), leaf));
    let (samples, unit) = match config {
        SamplingConfig::None {} => (each(&with_normals, |(scan, given)| whole(scan, given.clone())), None),
        SamplingConfig::VoxelGrid(grid) => (thin(grid.leaf.resolve(raw_resolution)), None),
        SamplingConfig::Budget(budget) => {
            let count = |leaf: f64| each(scans, |scan| voxel_count(scan.points(), leaf) as f64);
            let leaf = within_budget(budget, raw_resolution, |leaf| mean(&count(leaf)));
            (thin(leaf), Some(leaf / 2.0))
        }
    };
    let parts: Vec<(Sample, &Scan)> = samples.into_iter().zip(scans.iter().copied()).collect();
    let clouds: Vec<_> = parts.into_par_iter().map(|(sample, scan)| Cloud::new(sample, scan, queries)).collect();
    // The first failure, not the one that happened first.
    let clouds = clouds.into_iter().collect::<Result<Vec<Cloud>, Failure>>()?;
    let resolution = unit.unwrap_or_else(|| mean(&clouds.iter().map(|cloud| cloud.resolution).collect::<Vec<_>>()));
    Ok(Sampled { clouds, strays, raw_resolution, resolution })
}

/// How many points of a scan `[sampling.budget]` leaves out because they hang alone.
#[must_use]
pub fn count_strays(scan: &Scan) -> usize {
    scan.points().len() - Measured::new(scan, ESTIMATE_AT, Strays::Dropped).scan.points().len()
}

/// The scans' own normals; none where one of them has none, since the signs of given and of estimated ones differ.
fn given_by_all(scans: &[&Scan], source: NormalSource) -> Vec<Option<Vec<Point>>> {
    match source {
        NormalSource::Given if scans.iter().all(|scan| has_normals(scan)) => each(scans, |scan| given_normals(scan)),
        NormalSource::Given | NormalSource::Estimated => vec![None; scans.len()],
    }
}

/// The same work for all, side by side where there are threads.
fn each<T: Sync, U: Send>(all: &[T], work: impl Fn(&T) -> U + Sync) -> Vec<U> {
    all.par_iter().map(&work).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

impl<'a> Measured<'a> {
    fn new(scan: &'a Scan, queries: usize, strays: Strays) -> Self {
        let measured = raw_resolution(scan, queries);
        let cleaned = if strays == Strays::Dropped { without_strays(scan, &measured) } else { None };
        match cleaned {
            Some(cleaned) => {
                let resolution = raw_resolution(&cleaned, queries).mean;
                Measured { scan: Cow::Owned(cleaned), resolution }
            }
            None => Measured { scan: Cow::Borrowed(scan), resolution: measured.mean },
        }
    }
}

fn raw_resolution(scan: &Scan, queries: usize) -> Resolution {
    let measured = match queries {
        usize::MAX => resolution(scan.points(), &NeighborIndex::new(scan.points())),
        _ => resolution_sampled(scan.points(), queries),
    };
    measured.expect("a scan has three distinct points")
}

fn whole(scan: &Scan, normals: Option<Vec<Point>>) -> Sample {
    Sample { points: scan.points().to_vec(), normals }
}

/// Enlarges the grid until it leaves few enough points; the side of a cell. `count` is how many a grid leaves.
fn within_budget(budget: &BudgetConfig, raw_resolution: f64, count: impl Fn(f64) -> f64) -> f64 {
    let mut leaf = budget.leaf.resolve(raw_resolution);
    loop {
        let excess = count(leaf) / budget.max_points.max(3) as f64;
        if excess <= 1.0 {
            return leaf;
        }
        leaf *= (CAUTION * excess.sqrt()).max(MIN_GROWTH);
    }
}

impl Cloud {
    fn new(sample: Sample, scan: &Scan, queries: usize) -> Result<Cloud, Failure> {
        let index = NeighborIndex::new(&sample.points);
        match resolution_at(&sample.points, &index, queries) {
            Some(resolution) if sample.points.len() >= 3 => {
                let (origin, viewpoint) = (*scan.origin(), scan.viewpoint());
                Ok(Cloud { sample, origin, viewpoint, index, resolution: resolution.mean })
            }
            _ => Err(Failure::FewPoints { left: sample.points.len(), of: scan.points().len() }),
        }
    }

    /// Adds the normals; `resolution` is what `pr` means.
    pub(crate) fn into_surface(self, config: &NormalsConfig, resolution: f64) -> (Surface, Oriented) {
        let points = self.sample.points;
        let neighborhood = match config.neighborhood {
            NeighborhoodConfig::Nearest(k) => Neighborhood::Nearest(k),
            NeighborhoodConfig::Radius(radius) => {
                Neighborhood::RadiusAtLeast(radius.resolve(resolution), MIN_NEIGHBORS)
            }
        };
        let mut normals: Vec<Point> =
            estimate_normals(&points, &self.index, neighborhood).iter().map(|n| n.normal).collect();
        // A viewpoint that is known need not be estimated.
        let policy = match (config.orientation, self.viewpoint) {
            (Orientation::Estimated {}, Some(known)) => Orientation::Viewpoint { at: (known + self.origin).into() },
            (policy, _) => policy,
        };
        let oriented = orient(policy, &points, &self.origin, &self.index, resolution, &mut normals);
        for (normal, given) in normals.iter_mut().zip(self.sample.normals.iter().flatten()) {
            if *given != [0.0; 3] {
                *normal = *given;
            }
        }
        (Surface::new(points, normals, self.index, self.resolution), oriented)
    }
}

/// Whether a scan has normals of its own.
pub(crate) fn has_normals(scan: &Scan) -> bool {
    !scan.triangles().is_empty() || scan.normals().is_some()
}

/// A mesh's triangles say more than normals that somebody wrote into the file.
fn given_normals(scan: &Scan) -> Option<Vec<Point>> {
    if scan.triangles().is_empty() {
        scan.normals().map(<[Point]>::to_vec)
    } else {
        Some(vertex_normals(scan.points(), scan.triangles()))
    }
}
