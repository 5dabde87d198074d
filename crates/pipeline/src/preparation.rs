//! From a scan to a surface: a thinned cloud with normals.

use crate::config::{BudgetConfig, NeighborhoodConfig};
use crate::{Failure, NormalSource, NormalsConfig, SamplingConfig, Strays};
use congruent_geometry::{
    NeighborIndex, Neighborhood, Orientation, Oriented, Point, Resolution, Sample, Scan, Scanner, Spacings, Surface,
    estimate_normals, orient, resolution, resolution_at, vertex_normals, voxel_centroids, voxel_count, without_strays,
};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Minimum number of neighbours from which a normal is estimated, even if the radius contains fewer.
const MIN_NEIGHBORS: usize = 6;
/// Number of points at which a resolution is estimated; the estimate is accurate to about one per cent.
const ESTIMATE_AT: usize = 4000;
/// A grid that leaves too many points is enlarged at least by this factor …
const MIN_GROWTH: f64 = 1.02;
/// … and by this fraction of the factor that would suffice if the scan were a uniform sheet.
const CAUTION: f64 = 0.97;

/// Thinned scans, and the lengths that belong to them in data units.
pub(crate) struct Sampled {
    pub(crate) clouds: Vec<Cloud>,
    /// Number of points of each scan that were left out as strays.
    pub(crate) strays: Vec<usize>,
    /// Mean resolution of the scans as provided, without strays.
    pub(crate) raw_resolution: f64,
    /// The meaning of `pr` from here on.
    pub(crate) resolution: f64,
}

/// A thinned scan.
pub(crate) struct Cloud {
    sample: Sample,
    origin: Vector3<f64>,
    /// Position of the scanner, if it is known; centred.
    viewpoint: Option<Vector3<f64>>,
    /// The scanner, if the points before thinning give it away.
    scanner: Option<Scanner>,
    index: NeighborIndex,
    resolution: f64,
}

/// A scan to be thinned.
struct Measured<'a> {
    /// A new scan if strays were left out.
    scan: Cow<'a, Scan>,
    resolution: f64,
    scanner: Option<Scanner>,
}

/// Thins all scans with the same grid; there must be at least one.
pub(crate) fn sample(scans: &[&Scan], config: &SamplingConfig, normals: NormalSource) -> Result<Sampled, Failure> {
    assert!(!scans.is_empty(), "at least one scan");
    // The paper's chain measures its scans as exactly as possible; a budget only needs a starting point.
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
    let parts: Vec<(Sample, &Measured<'_>)> = samples.into_iter().zip(&measured).collect();
    let clouds: Vec<_> = parts.into_par_iter().map(|(sample, of)| Cloud::new(sample, of, queries)).collect();
    // The failure of the first scan in the list, not the one that occurred first.
    let clouds = clouds.into_iter().collect::<Result<Vec<Cloud>, Failure>>()?;
    let resolution = unit.unwrap_or_else(|| mean(&clouds.iter().map(|cloud| cloud.resolution).collect::<Vec<_>>()));
    Ok(Sampled { clouds, strays, raw_resolution, resolution })
}

/// Returns how many points of a scan `[sampling.budget]` leaves out as strays.
#[must_use]
pub fn count_strays(scan: &Scan) -> usize {
    scan.points().len() - Measured::new(scan, ESTIMATE_AT, Strays::Dropped).scan.points().len()
}

/// Returns the scans' own normals; none if any scan lacks them, because the signs of given and of estimated normals
/// differ.
fn given_by_all(scans: &[&Scan], source: NormalSource) -> Vec<Option<Vec<Point>>> {
    match source {
        NormalSource::Given if scans.iter().all(|scan| has_normals(scan)) => each(scans, |scan| given_normals(scan)),
        NormalSource::Given | NormalSource::Estimated => vec![None; scans.len()],
    }
}

/// Applies a function to all in parallel; the results are in the same order.
fn each<T: Sync, U: Send>(all: &[T], work: impl Fn(&T) -> U + Sync) -> Vec<U> {
    all.par_iter().map(&work).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

impl<'a> Measured<'a> {
    fn new(scan: &'a Scan, queries: usize, strays: Strays) -> Self {
        let (resolution, spacings) = raw_resolution(scan, queries);
        let cleaned = if strays == Strays::Dropped { without_strays(scan, &resolution) } else { None };
        match cleaned {
            Some(cleaned) => {
                let (resolution, spacings) = raw_resolution(&cleaned, queries);
                let scanner = scanner(&cleaned, spacings);
                Measured { scan: Cow::Owned(cleaned), resolution: resolution.mean, scanner }
            }
            None => {
                Measured { scan: Cow::Borrowed(scan), resolution: resolution.mean, scanner: scanner(scan, spacings) }
            }
        }
    }
}

/// Returns the resolution, and the spacings if only some points are measured.
fn raw_resolution(scan: &Scan, queries: usize) -> (Resolution, Option<Spacings<'_>>) {
    let (measured, spacings) = match queries {
        usize::MAX => (resolution(scan.points(), &NeighborIndex::new(scan.points())), None),
        _ => {
            let spacings = Spacings::sampled(scan.points(), queries);
            (spacings.resolution(), Some(spacings))
        }
    };
    (measured.expect("a scan has three distinct points"), spacings)
}

/// Returns the scanner that the spacings give away; a known viewpoint need not be estimated.
fn scanner(scan: &Scan, spacings: Option<Spacings<'_>>) -> Option<Scanner> {
    spacings.filter(|_| scan.viewpoint().is_none())?.scanner()
}

fn whole(scan: &Scan, normals: Option<Vec<Point>>) -> Sample {
    Sample { points: scan.points().to_vec(), normals }
}

/// Enlarges the grid until few enough points remain, and returns the side of a cell. `count` returns how many a grid
/// leaves.
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
    fn new(sample: Sample, of: &Measured<'_>, queries: usize) -> Result<Cloud, Failure> {
        let scan = of.scan.as_ref();
        let index = NeighborIndex::new(&sample.points);
        match resolution_at(&sample.points, &index, queries) {
            Some(resolution) if sample.points.len() >= 3 => {
                let (origin, viewpoint, scanner) = (*scan.origin(), scan.viewpoint(), of.scanner.clone());
                Ok(Cloud { sample, origin, viewpoint, scanner, index, resolution: resolution.mean })
            }
            _ => Err(Failure::FewPoints { left: sample.points.len(), of: scan.points().len() }),
        }
    }

    /// Adds the normals; `resolution` is the meaning of `pr`.
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
        // A known viewpoint need not be estimated.
        let policy = match (config.orientation, self.viewpoint) {
            (Orientation::Estimated {}, Some(known)) => Orientation::Viewpoint { at: (known + self.origin).into() },
            (policy, _) => policy,
        };
        let oriented =
            orient(policy, &points, &self.origin, &self.index, resolution, self.scanner.as_ref(), &mut normals);
        for (normal, given) in normals.iter_mut().zip(self.sample.normals.iter().flatten()) {
            if *given != [0.0; 3] {
                *normal = *given;
            }
        }
        (Surface::new(points, normals, self.index, self.resolution), oriented)
    }
}

/// Returns whether a scan has normals of its own.
pub(crate) fn has_normals(scan: &Scan) -> bool {
    !scan.triangles().is_empty() || scan.normals().is_some()
}

/// Returns the normals of a scan: from its triangles, which are more reliable than normals in the file, if it is a
/// mesh.
fn given_normals(scan: &Scan) -> Option<Vec<Point>> {
    if scan.triangles().is_empty() {
        scan.normals().map(<[Point]>::to_vec)
    } else {
        Some(vertex_normals(scan.points(), scan.triangles()))
    }
}
