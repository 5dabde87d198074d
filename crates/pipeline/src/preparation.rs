//! From a scan to a surface: thinned, with normals.

use crate::config::{BudgetConfig, NeighborhoodConfig};
use crate::{Failure, NormalSource, NormalsConfig, Pair, SamplingConfig};
use congruent_geometry::{
    NeighborIndex, Neighborhood, Oriented, Point, Sample, Scan, Surface, estimate_normals, orient, resolution,
    resolution_at, vertex_normals, voxel_centroids,
};
use nalgebra::Vector3;

/// Fewest neighbours that a normal is estimated from, where a radius finds fewer.
const MIN_NEIGHBORS: usize = 6;
/// Points at which a resolution is estimated (it is then good to about one per cent).
const ESTIMATE_AT: usize = 4000;
/// A grid that leaves too many points is enlarged by at least this factor …
const MIN_GROWTH: f64 = 1.02;
/// … and by this share of what would be enough if the scan were an even sheet.
const CAUTION: f64 = 0.97;

/// Two thinned scans and the lengths that go with them, data units.
pub(crate) struct Sampled {
    pub(crate) clouds: Pair<Cloud>,
    /// Mean resolution of the scans as they came.
    pub(crate) raw_resolution: f64,
    /// What `pr` means from here on.
    pub(crate) resolution: f64,
}

/// A thinned scan.
pub(crate) struct Cloud {
    sample: Sample,
    origin: Vector3<f64>,
    index: NeighborIndex,
    resolution: f64,
}

/// Thins both scans with the same grid.
pub(crate) fn sample(scans: &Pair<&Scan>, config: &SamplingConfig, normals: NormalSource) -> Result<Sampled, Failure> {
    // The paper's chain measures every point; a budget only needs to know where to start.
    let queries = if matches!(config, SamplingConfig::Budget(_)) { ESTIMATE_AT } else { usize::MAX };
    let raw_resolution = scans.map(|scan| raw_resolution(scan, queries)).mean();
    let given = scans.map(|scan| match normals {
        NormalSource::Estimated => None,
        NormalSource::Given => given_normals(scan),
    });
    let thin = |leaf: f64| {
        scans.zip(given.as_ref()).map(|(scan, given)| voxel_centroids(scan.points(), given.as_deref(), leaf))
    };
    let (samples, unit) = match config {
        SamplingConfig::None {} => (whole(scans, given.clone()), None),
        SamplingConfig::VoxelGrid(grid) => (thin(grid.leaf.resolve(raw_resolution)), None),
        SamplingConfig::Budget(budget) => {
            let (samples, leaf) = within_budget(budget, raw_resolution, thin);
            (samples, Some(leaf / 2.0))
        }
    };
    let origins = scans.map(|scan| *scan.origin());
    let clouds = samples.zip(origins).into_map(|(sample, origin)| Cloud::new(sample, origin, queries)).both()?;
    let resolution = unit.unwrap_or_else(|| clouds.map(|cloud| cloud.resolution).mean());
    Ok(Sampled { clouds, raw_resolution, resolution })
}

fn raw_resolution(scan: &Scan, queries: usize) -> f64 {
    let index = NeighborIndex::new(scan.points());
    let measured = match queries {
        usize::MAX => resolution(scan.points(), &index),
        _ => resolution_at(scan.points(), &index, queries),
    };
    measured.expect("a scan has three distinct points").mean
}

fn whole(scans: &Pair<&Scan>, normals: Pair<Option<Vec<Point>>>) -> Pair<Sample> {
    scans.zip(normals).into_map(|(scan, normals)| Sample { points: scan.points().to_vec(), normals })
}

/// Enlarges the grid until it leaves few enough points; the samples and the side of a cell.
fn within_budget(
    budget: &BudgetConfig,
    raw_resolution: f64,
    thin: impl Fn(f64) -> Pair<Sample>,
) -> (Pair<Sample>, f64) {
    let mut leaf = budget.leaf.resolve(raw_resolution);
    loop {
        let samples = thin(leaf);
        let points = samples.map(|sample| sample.points.len() as f64).mean();
        let excess = points / budget.max_points.max(3) as f64;
        if excess <= 1.0 {
            return (samples, leaf);
        }
        leaf *= (CAUTION * excess.sqrt()).max(MIN_GROWTH);
    }
}

impl Cloud {
    fn new(sample: Sample, origin: Vector3<f64>, queries: usize) -> Result<Cloud, Failure> {
        let index = NeighborIndex::new(&sample.points);
        match resolution_at(&sample.points, &index, queries) {
            Some(resolution) if sample.points.len() >= 3 => {
                Ok(Cloud { sample, origin, index, resolution: resolution.mean })
            }
            _ => Err(Failure::FewPoints { left: sample.points.len() }),
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
        let oriented = orient(config.orientation, &points, &self.origin, &self.index, resolution, &mut normals);
        for (normal, given) in normals.iter_mut().zip(self.sample.normals.iter().flatten()) {
            if *given != [0.0; 3] {
                *normal = *given;
            }
        }
        (Surface::new(points, normals, self.index, self.resolution), oriented)
    }
}

/// A mesh's triangles say more than normals that somebody wrote into the file.
fn given_normals(scan: &Scan) -> Option<Vec<Point>> {
    if scan.triangles().is_empty() {
        scan.normals().map(<[Point]>::to_vec)
    } else {
        Some(vertex_normals(scan.points(), scan.triangles()))
    }
}
