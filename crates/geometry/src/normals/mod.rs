//! Normals by principal component analysis of a neighbourhood, and the side of the surface to which they point.

mod eigen;
mod mesh;
mod orientation;
mod outer_sum;
mod scatter;

pub use eigen::{SortedEigen, sorted_eigen};
pub use mesh::vertex_normals;
pub(crate) use orientation::propagate;
pub use orientation::{Orientation, Oriented, orient};
pub use outer_sum::OuterSum;

use self::scatter::{Beside, Near, Scatter, normals_of, scatters_in_block};
use crate::neighbors::blocks::Block;
use crate::{NeighborIndex, OrderedPoints, Point};
use rayon::prelude::*;
use std::ops::Range;

/// Which points contribute to the normal of a point; the point itself is one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Neighborhood {
    /// The `k` nearest points, the point itself included.
    Nearest(usize),
    /// All points within this distance, data units.
    Radius(f64),
    /// All points within this distance (data units), or this many nearest points if there are fewer.
    RadiusAtLeast(f64, usize),
}

/// A surface normal whose sign is not settled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointNormal {
    /// Unit length; zero if undefined (fewer than three neighbours, or all on a line).
    pub normal: Point,
    /// Surface variation λ0 / (λ0 + λ1 + λ2): 0 on a plane, at most 1/3.
    pub curvature: f32,
}

/// Returns the normal of every point: the direction in which its neighbours spread least.
#[must_use]
pub fn estimate_normals(points: &[Point], index: &NeighborIndex, neighborhood: Neighborhood) -> Vec<PointNormal> {
    Around::new(points, index, neighborhood).normals()
}

/// Number of points at which the radius that holds `k` neighbours is measured, and the multiple of the median that is
/// tried.
const GUESSED_AT: usize = 64;
const GUESS: f64 = 1.2;
/// Number of points in the cell of a point, on average, up to which the radius is so small that a tree finds the nearest
/// points faster: that of another scan in another unit.
const LONELY: f64 = 1.05;
/// Factor by which a cell is wider than a radius, so that rounding puts nothing that is within the radius outside a
/// block.
const WIDER: f64 = 1.001;
/// Factor by which the search is widened for neighbours that are not within the guess.
const FARTHER: f64 = 2.0;

/// Finds the neighbours that contribute to a normal.
struct Around<'a> {
    points: &'a [Point],
    index: &'a NeighborIndex,
    neighborhood: Neighborhood,
    /// `None` for a crowded cloud.
    ordered: Option<OrderedPoints>,
    /// The requested radius, or one that holds about the requested number of neighbours; data units.
    radius: f64,
}

/// Buffers that a thread reuses from cell to cell.
#[derive(Default)]
struct Workplace {
    beside: Beside,
    seen: Vec<Option<Scatter>>,
    scatters: Vec<Scatter>,
    farther: Farther,
}

/// Buffers that it reuses for points whose block does not suffice.
#[derive(Default)]
struct Farther {
    block: Block,
    runs: Vec<Range<usize>>,
    seen: Vec<Option<Scatter>>,
    found: Vec<u64>,
}

impl<'a> Around<'a> {
    fn new(points: &'a [Point], index: &'a NeighborIndex, neighborhood: Neighborhood) -> Self {
        let radius = match neighborhood {
            Neighborhood::Nearest(k) => GUESS * median_reach(points, index, k),
            Neighborhood::Radius(radius) | Neighborhood::RadiusAtLeast(radius, _) => radius,
        };
        let ordered = OrderedPoints::unless_crowded(points, WIDER * radius);
        let ordered = ordered.filter(|ordered| ordered.cells().crowding() > LONELY);
        Around { points, index, neighborhood, ordered, radius }
    }

    fn normals(&self) -> Vec<PointNormal> {
        let Some(ordered) = &self.ordered else {
            let scatters: Vec<Scatter> = self.points.par_iter().map(|point| self.scatter(point)).collect();
            let mut normals = vec![PointNormal::default(); scatters.len()];
            normals_of(&scatters, &mut normals);
            return normals;
        };
        let normals = ordered.each_block(|workplace: &mut Workplace, members, block, normals| {
            self.seen(ordered, workplace, members, block);
            normals_of(&workplace.scatters, normals);
        });
        ordered.in_order_of_points(&normals)
    }

    /// Computes the scatters of a cell's points, most of which need only its block.
    fn seen(&self, ordered: &OrderedPoints, workplace: &mut Workplace, members: Range<usize>, block: &Block) {
        let limit = self.radius as f32 * self.radius as f32;
        let near = match self.neighborhood {
            Neighborhood::Nearest(k) => Near::Nearest(k as u32, limit),
            Neighborhood::Radius(_) => Near::Within(limit, 0),
            Neighborhood::RadiusAtLeast(_, k) => Near::Within(limit, k as u32),
        };
        let Workplace { beside, seen, scatters, farther } = workplace;
        scatters_in_block(members.clone(), ordered.columns(), block.columns(), near, beside, seen);
        scatters.clear();
        scatters.extend(members.zip(seen).map(|(place, seen)| match seen {
            Some(scatter) => *scatter,
            None => self.farther(ordered, farther, beside, place),
        }));
    }

    /// Computes the scatter of the nearest neighbours of the point at a place, in a wider block or by a search.
    fn farther(
        &self,
        ordered: &OrderedPoints,
        Farther { block, runs, seen, found }: &mut Farther,
        beside: &mut Beside,
        place: usize,
    ) -> Scatter {
        let (Neighborhood::Nearest(k) | Neighborhood::RadiusAtLeast(_, k)) = self.neighborhood else {
            return Scatter::default();
        };
        let (point, radius) = (ordered.point(place), FARTHER * self.radius);
        runs.clear();
        ordered.cells().around(&point, radius, |run| runs.push(run));
        block.gather(ordered, runs);
        let near = Near::Nearest(k as u32, radius as f32 * radius as f32);
        scatters_in_block(place..place + 1, ordered.columns(), block.columns(), near, beside, seen);
        seen[0].unwrap_or_else(|| {
            let mut scatter = Scatter::default();
            ordered.nearest_n(&point, k, radius, found);
            found.iter().for_each(|&place| scatter.add(&ordered.point(place as usize), &point));
            scatter
        })
    }

    /// Computes the scatter of the neighbours of a point with the tree.
    fn scatter(&self, point: &Point) -> Scatter {
        match self.neighborhood {
            Neighborhood::Nearest(k) => self.nearest(point, k),
            Neighborhood::Radius(radius) => self.within(point, radius),
            Neighborhood::RadiusAtLeast(radius, k) => {
                let within = self.within(point, radius);
                if within.n < k as f64 { self.nearest(point, k) } else { within }
            }
        }
    }

    fn nearest(&self, point: &Point, k: usize) -> Scatter {
        let mut scatter = Scatter::default();
        self.index.nearest_n(point, k).iter().for_each(|n| scatter.add(&self.points[n.index as usize], point));
        scatter
    }

    fn within(&self, point: &Point, radius: f64) -> Scatter {
        let mut scatter = Scatter::default();
        self.index.within(point, radius, |n| scatter.add(&self.points[n.index as usize], point));
        scatter
    }
}

/// Returns the median distance to the `k`-th neighbour over a few points; zero if there is none.
fn median_reach(points: &[Point], index: &NeighborIndex, k: usize) -> f64 {
    let some = points.iter().step_by(points.len().div_ceil(GUESSED_AT).max(1));
    let mut reaches: Vec<f32> = some.filter_map(|p| Some(index.nearest_n(p, k).last()?.distance_sq.sqrt())).collect();
    reaches.sort_by(f32::total_cmp);
    reaches.get(reaches.len() / 2).map_or(0.0, |reach| f64::from(*reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::{narrow, wide};
    use nalgebra::Vector3;

    fn normals_of(points: &[Point], neighborhood: Neighborhood) -> Vec<PointNormal> {
        estimate_normals(points, &NeighborIndex::new(points), neighborhood)
    }

    /// Evenly spread points on the unit sphere (a golden spiral).
    fn sphere(n: usize) -> Vec<Point> {
        (0..n)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
                let angle = i as f64 * 2.399_963_229_728_653;
                let r = (1.0 - z * z).sqrt();
                narrow(&Vector3::new(r * angle.cos(), r * angle.sin(), z))
            })
            .collect()
    }

    #[test]
    fn a_plane_has_its_normal_and_no_curvature() {
        let points: Vec<Point> = (0..400).map(|i| [(i % 20) as f32, (i / 20) as f32, (i % 20) as f32]).collect();
        for n in normals_of(&points, Neighborhood::Radius(2.5)) {
            assert!(
                (n.normal[0] + n.normal[2]).abs() < 1e-6 && n.normal[1].abs() < 1e-6 && n.curvature < 1e-9,
                "{n:?}"
            );
        }
    }

    #[test]
    fn a_crowded_cloud_is_searched_by_its_tree_with_the_same_result() {
        let points = sphere(900);
        let index = NeighborIndex::new(&points);
        for neighborhood in [Neighborhood::Nearest(12), Neighborhood::Radius(0.3), Neighborhood::RadiusAtLeast(0.1, 9)]
        {
            let by_grid = Around::new(&points, &index, neighborhood);
            assert!(by_grid.ordered.is_some());
            let by_tree = Around { ordered: None, ..Around::new(&points, &index, neighborhood) };
            let Some(ordered) = &by_grid.ordered else { unreachable!() };
            let scatters = ordered.each_block(|workplace: &mut Workplace, members, block, scatters| {
                by_grid.seen(ordered, workplace, members, block);
                scatters.copy_from_slice(&workplace.scatters);
            });
            for (point, one) in points.iter().zip(ordered.in_order_of_points(&scatters)) {
                let other = by_tree.scatter(point);
                assert!(one.n == other.n && (one.sum - other.sum).norm() < 1e-9, "{neighborhood:?}");
            }
            for (one, other) in by_grid.normals().iter().zip(by_tree.normals()) {
                let cosine = wide(one.normal).dot(&wide(other.normal)).abs();
                assert!(cosine > 1.0 - 1e-6 && (one.curvature - other.curvature).abs() < 1e-6, "{neighborhood:?}");
            }
        }
        let mut crowded: Vec<Point> = (0..5000).map(|i| [1e-6 * i as f32, 1e-6 * (i % 70) as f32, 0.0]).collect();
        crowded.extend(sphere(200));
        let index = NeighborIndex::new(&crowded);
        assert!(Around::new(&crowded, &index, Neighborhood::Radius(0.3)).ordered.is_none());
    }

    #[test]
    fn a_sphere_has_radial_normals() {
        let points = sphere(20_000);
        for (p, n) in points.iter().zip(normals_of(&points, Neighborhood::Nearest(20))) {
            assert!(wide(*p).dot(&wide(n.normal)).abs() > 1f64.to_radians().cos());
        }
    }

    #[test]
    fn normals_turn_with_the_cloud() {
        let mut stream = Stream::new(9, 0);
        let points: Vec<Point> = (0..500)
            .map(|_| {
                let (x, y) = (stream.between(-1.0, 1.0), stream.between(-1.0, 1.0));
                narrow(&Vector3::new(x, y, 0.3 * (2.0 * x).sin() + 0.2 * y * y))
            })
            .collect();
        let turn = stream.rotation();
        let turned: Vec<Point> = points.iter().map(|p| narrow(&(turn * wide(*p)))).collect();
        let (before, after) =
            (normals_of(&points, Neighborhood::Radius(0.3)), normals_of(&turned, Neighborhood::Radius(0.3)));
        let same = before
            .iter()
            .zip(&after)
            .filter(|(b, a)| (turn * wide(b.normal)).dot(&wide(a.normal)).abs() > 1.0 - 1e-4)
            .count();
        // A neighbour on the very rim of the radius may fall on either side after rounding.
        assert!(same >= 495, "{same} of 500");
    }

    #[test]
    fn lines_and_lone_points_have_none() {
        let line: Vec<Point> = (0..10).map(|i| [i as f32, 0.0, 0.0]).collect();
        assert!(normals_of(&line, Neighborhood::Nearest(5)).iter().all(|n| n.normal == [0.0; 3]));
        assert!(normals_of(&line, Neighborhood::Radius(0.5)).iter().all(|n| n.normal == [0.0; 3]));
    }
}
