//! From a scan to a surface: thinned, with normals.

use crate::{Failure, NormalSource, NormalsConfig, Pair, SamplingConfig};
use congruent_geometry::{
    NeighborIndex, Neighborhood, Point, Sample, Scan, Surface, estimate_normals, orient, resolution, vertex_normals,
    voxel_centroids,
};
use nalgebra::Vector3;

/// A scan as the chain works on it.
pub(crate) struct Cloud {
    sample: Sample,
    origin: Vector3<f64>,
    index: NeighborIndex,
    pub(crate) resolution: f64,
}

/// The mean distance between neighbours of each scan as it came.
pub(crate) fn raw_resolutions(scans: &Pair<&Scan>) -> Pair<f64> {
    scans.map(|scan| {
        let index = NeighborIndex::new(scan.points());
        resolution(scan.points(), &index).expect("a scan has three distinct points").mean
    })
}

/// Thins both scans with the same grid.
pub(crate) fn sample(
    scans: &Pair<&Scan>,
    config: &SamplingConfig,
    raw: Pair<f64>,
    normals: NormalSource,
) -> Result<Pair<Cloud>, Failure> {
    scans.map(|scan| Cloud::new(scan, config, raw.mean(), normals)).both()
}

impl Cloud {
    fn new(scan: &Scan, config: &SamplingConfig, raw_resolution: f64, normals: NormalSource) -> Result<Cloud, Failure> {
        let given = match normals {
            NormalSource::Estimated => None,
            NormalSource::Given => given_normals(scan),
        };
        let sample = match config {
            SamplingConfig::None {} => Sample { points: scan.points().to_vec(), normals: given },
            SamplingConfig::VoxelGrid(grid) => {
                voxel_centroids(scan.points(), given.as_deref(), grid.leaf.resolve(raw_resolution))
            }
        };
        let index = NeighborIndex::new(&sample.points);
        let few = Failure::FewPoints { left: sample.points.len() };
        match resolution(&sample.points, &index) {
            Some(resolution) if sample.points.len() >= 3 => {
                Ok(Cloud { sample, origin: *scan.origin(), index, resolution: resolution.mean })
            }
            _ => Err(few),
        }
    }

    /// Adds the normals.
    pub(crate) fn into_surface(self, config: &NormalsConfig) -> Surface {
        let points = self.sample.points;
        let estimated = estimate_normals(&points, &self.index, Neighborhood::Nearest(config.neighbors));
        let mut normals: Vec<Point> = estimated.iter().map(|n| n.normal).collect();
        orient(config.orientation, &points, &self.origin, &self.index, 0.5 * self.resolution, &mut normals);
        for (normal, given) in normals.iter_mut().zip(self.sample.normals.iter().flatten()) {
            if *given != [0.0; 3] {
                *normal = *given;
            }
        }
        Surface::new(points, normals, self.index, self.resolution)
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
