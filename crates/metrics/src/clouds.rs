//! The two clouds as dense metrics need them: points of the source to move, and neighbours among those of the target.

use crate::motion::Motion;
use congruent_geometry::{NearestTable, NeighborIndex, Point, RigidTransform, Surface, voxel_centroids};
use serde::{Deserialize, Serialize};

/// The surfaces that are being registered.
#[derive(Clone, Copy)]
pub struct Clouds<'a> {
    /// The surface that is moved.
    pub source: &'a Surface,
    /// The surface that it is moved onto.
    pub target: &'a Surface,
}

/// Which points a dense metric uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Density {
    /// Voxel centroids of both clouds; the larger the source, the larger the voxels.
    #[default]
    Thinned,
    /// All points.
    Full,
}

/// Points of the source and neighbours in the target, thinned or not.
pub(crate) struct CloudPair<'a> {
    source: Points<'a>,
    target: Nearest<'a>,
}

enum Points<'a> {
    Lent(&'a [Point]),
    Own(Vec<Point>),
}

/// How the nearest point of the target is looked up.
enum Nearest<'a> {
    /// If distances matter only up to a reach.
    Table(NearestTable),
    Lent(&'a NeighborIndex),
    Own(NeighborIndex),
}

impl<'a> CloudPair<'a> {
    /// Prepares the clouds. `resolution` is that of the pair; the voxels are in units of it. Distances above `reach`
    /// (data units) do not matter.
    pub(crate) fn new(clouds: Clouds<'a>, density: Density, resolution: f64, reach: f64) -> Self {
        let Clouds { source, target } = clouds;
        match density {
            Density::Full => {
                let table = NearestTable::new(target.points(), reach).map(Nearest::Table);
                let target = table.unwrap_or_else(|| Nearest::Lent(target.index()));
                CloudPair { source: Points::Lent(source.points()), target }
            }
            Density::Thinned => {
                let leaf = leaf(source.len()) * resolution;
                let thinned = |surface: &Surface| voxel_centroids(surface.points(), None, leaf).points;
                let target = thinned(target);
                let table = NearestTable::new(&target, reach).map(Nearest::Table);
                let target = table.unwrap_or_else(|| Nearest::Own(NeighborIndex::new(&target)));
                CloudPair { source: Points::Own(thinned(source)), target }
            }
        }
    }

    /// Returns the number of source points.
    pub(crate) fn len(&self) -> usize {
        self.points().len()
    }

    /// Visits the squared distance from each moved source point to the nearest target point, in order; nothing if the
    /// target is empty. Points farther than the reach may be left out.
    pub(crate) fn each_distance_sq(&self, target_from_source: &RigidTransform, mut visit: impl FnMut(f32)) {
        let motion = Motion::new(target_from_source);
        let moved = self.points().iter().map(|p| motion.moved(p));
        match &self.target {
            Nearest::Table(table) => table.each_nearest_sq(moved, visit),
            Nearest::Lent(index) => moved.filter_map(|p| index.nearest(&p)).for_each(|found| visit(found.distance_sq)),
            Nearest::Own(index) => moved.filter_map(|p| index.nearest(&p)).for_each(|found| visit(found.distance_sq)),
        }
    }

    fn points(&self) -> &[Point] {
        match &self.source {
            Points::Lent(points) => points,
            Points::Own(points) => points,
        }
    }
}

/// Returns the side of a voxel in units of the resolution, for a source of `n` points; values from the authors'
/// programs.
fn leaf(n: usize) -> f64 {
    const LEAVES: [(usize, f64); 5] = [(5_000, 1.0), (12_000, 2.0), (18_000, 2.5), (25_000, 3.0), (32_000, 3.5)];
    LEAVES.iter().find(|(below, _)| n < *below).map_or(4.0, |(_, leaf)| *leaf)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    /// A surface of these points with normals along z.
    pub(crate) fn surface(points: Vec<Point>) -> Surface {
        let index = NeighborIndex::new(&points);
        let normals = vec![[0.0, 0.0, 1.0]; points.len()];
        Surface::new(points, normals, index, 1.0)
    }

    /// All distances.
    fn distances_sq(pair: &CloudPair<'_>, pose: &RigidTransform) -> Vec<f32> {
        let mut distances = Vec::new();
        pair.each_distance_sq(pose, |d| distances.push(d));
        distances
    }

    /// Points scattered over a box of side 100.
    pub(crate) fn scatter(n: usize, seed: u64) -> Vec<Point> {
        let mut stream = Stream::new(seed, 0);
        (0..n).map(|_| std::array::from_fn(|_| stream.between(-50.0, 50.0) as f32)).collect()
    }

    #[test]
    fn the_leaf_grows_with_the_source() {
        for (n, expected) in
            [(0, 1.0), (4_999, 1.0), (5_000, 2.0), (17_999, 2.5), (24_999, 3.0), (31_999, 3.5), (32_000, 4.0)]
        {
            assert_eq!(leaf(n), expected, "{n}");
        }
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        let (source, target) = (surface(scatter(200, 1)), surface(scatter(300, 2)));
        let pose = RigidTransform::new(nalgebra::Vector3::new(3.0, -1.0, 2.0), nalgebra::Vector3::new(0.1, 0.2, -0.3));
        let pair = CloudPair::new(Clouds { source: &source, target: &target }, Density::Full, 1.0, f64::INFINITY);
        let moved = |p: &Point| (pose * nalgebra::Point3::from(congruent_geometry::wide(*p))).coords;
        for (p, found) in source.points().iter().zip(distances_sq(&pair, &pose)) {
            let to = |q: &Point| (congruent_geometry::wide(*q) - moved(p)).norm_squared();
            let expected = target.points().iter().map(to).fold(f64::INFINITY, f64::min);
            assert!((f64::from(found) - expected).abs() < 1e-3 * (1.0 + expected));
        }
    }

    #[test]
    fn with_a_reach_no_distance_within_it_changes() {
        let (source, target) = (surface(scatter(400, 1)), surface(scatter(60, 2)));
        let clouds = Clouds { source: &source, target: &target };
        let pair = |reach| CloudPair::new(clouds, Density::Full, 1.0, reach);
        for x in [0.0, 20.0, 90.0] {
            let pose = RigidTransform::translation(x, 3.0, -2.0);
            let within = |pair: CloudPair<'_>| {
                let mut near = distances_sq(&pair, &pose);
                near.retain(|d| *d < 49.0);
                near
            };
            assert_eq!(within(pair(7.0)), within(pair(f64::INFINITY)));
            assert!(distances_sq(&pair(7.0), &pose).len() < 380);
        }
    }

    #[test]
    fn thinning_leaves_fewer_points_and_the_same_shape() {
        let cloud = surface(scatter(6_000, 3));
        let clouds = Clouds { source: &cloud, target: &cloud };
        let (full, thin) = (
            CloudPair::new(clouds, Density::Full, 5.0, f64::INFINITY),
            CloudPair::new(clouds, Density::Thinned, 5.0, f64::INFINITY),
        );
        assert_eq!(full.len(), 6_000);
        // Voxels of side 10 in a box of side 100.
        assert!(thin.len() <= 11 * 11 * 11 && thin.len() >= 900, "{}", thin.len());
        assert!(distances_sq(&thin, &RigidTransform::identity()).iter().all(|d| *d < 1e-6));
    }

    #[test]
    fn an_empty_target_gives_no_distance() {
        let (cloud, none) = (surface(scatter(10, 4)), surface(vec![]));
        let pair = CloudPair::new(Clouds { source: &cloud, target: &none }, Density::Thinned, 1.0, f64::INFINITY);
        assert!(distances_sq(&pair, &RigidTransform::identity()).is_empty());
    }
}
