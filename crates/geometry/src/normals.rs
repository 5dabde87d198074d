//! Normals by principal component analysis of a neighbourhood.

use crate::eigen::{Smallest, smallest_eigen};
use crate::{NeighborIndex, OrderedPoints, OuterSum, Point, narrow, wide};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Which points speak for the normal of a point; the point itself is one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Neighborhood {
    /// The `k` nearest points, the point itself included.
    Nearest(usize),
    /// All points within this distance, data units.
    Radius(f64),
    /// The same, or so many nearest points where there are fewer.
    RadiusAtLeast(f64, usize),
}

/// A surface normal without a settled sign.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointNormal {
    /// Unit length; zero where there is none (fewer than three neighbours, or all on a line).
    pub normal: Point,
    /// Surface variation λ0 / (λ0 + λ1 + λ2): 0 on a plane, at most 1/3.
    pub curvature: f32,
}

/// The normal of every point: the direction in which its neighbours spread least.
#[must_use]
pub fn estimate_normals(points: &[Point], index: &NeighborIndex, neighborhood: Neighborhood) -> Vec<PointNormal> {
    let around = Around::new(points, index, neighborhood);
    let normal = |found: &mut Vec<u64>, point| around.scatter(point, found).normal().unwrap_or_default();
    points.par_iter().map_init(Vec::new, normal).collect()
}

/// Cells along a radius of search.
const CELLS_PER_RADIUS: f64 = 2.0;
/// Points at which the radius that holds `k` neighbours is measured; the guess is so many times the median.
const GUESSED_AT: usize = 64;
const GUESS: f64 = 1.15;

/// Finds the neighbours that speak for a normal.
struct Around<'a> {
    points: &'a [Point],
    index: &'a NeighborIndex,
    neighborhood: Neighborhood,
    /// Nothing for a crowded cloud.
    ordered: Option<OrderedPoints>,
    /// A radius that holds about as many neighbours as are asked for, data units.
    guess: f64,
}

impl<'a> Around<'a> {
    fn new(points: &'a [Point], index: &'a NeighborIndex, neighborhood: Neighborhood) -> Self {
        let guess = match neighborhood {
            Neighborhood::Nearest(k) => GUESS * median_reach(points, index, k),
            Neighborhood::Radius(radius) | Neighborhood::RadiusAtLeast(radius, _) => radius,
        };
        let ordered = OrderedPoints::unless_crowded(points, guess / CELLS_PER_RADIUS);
        Around { points, index, neighborhood, ordered, guess }
    }

    fn scatter(&self, point: &Point, found: &mut Vec<u64>) -> Scatter {
        match self.neighborhood {
            Neighborhood::Nearest(k) => self.nearest(point, k, found),
            Neighborhood::Radius(radius) => self.within(point, radius),
            Neighborhood::RadiusAtLeast(radius, k) => {
                let within = self.within(point, radius);
                if within.n < k as f64 { self.nearest(point, k, found) } else { within }
            }
        }
    }

    fn nearest(&self, point: &Point, k: usize, found: &mut Vec<u64>) -> Scatter {
        let mut scatter = Scatter::around(point);
        match &self.ordered {
            Some(ordered) => {
                ordered.nearest_n(point, k, self.guess, found);
                found.iter().for_each(|&place| scatter.add(&ordered.point(place as usize)));
            }
            None => {
                let nearest = self.index.nearest_n(point, k);
                nearest.iter().for_each(|n| scatter.add(&self.points[n.index as usize]));
            }
        }
        scatter
    }

    fn within(&self, point: &Point, radius: f64) -> Scatter {
        let mut scatter = Scatter::around(point);
        match &self.ordered {
            Some(ordered) => ordered.within(point, radius, |place, _| scatter.add(&ordered.point(place))),
            None => self.index.within(point, radius, |n| scatter.add(&self.points[n.index as usize])),
        }
        scatter
    }
}

/// The median distance to the `k`-th neighbour over a few points; zero where there is none.
fn median_reach(points: &[Point], index: &NeighborIndex, k: usize) -> f64 {
    let some = points.iter().step_by(points.len().div_ceil(GUESSED_AT).max(1));
    let mut reaches: Vec<f32> = some.filter_map(|p| Some(index.nearest_n(p, k).last()?.distance_sq.sqrt())).collect();
    reaches.sort_by(f32::total_cmp);
    reaches.get(reaches.len() / 2).map_or(0.0, |reach| f64::from(*reach))
}

/// First and second moments relative to a nearby point: without the shift, far coordinates would cancel.
struct Scatter {
    centre: Vector3<f64>,
    n: f64,
    sum: Vector3<f64>,
    squares: OuterSum,
}

impl Scatter {
    fn around(centre: &Point) -> Self {
        Scatter { centre: wide(*centre), n: 0.0, sum: Vector3::zeros(), squares: OuterSum::default() }
    }

    #[inline]
    fn add(&mut self, point: &Point) {
        let offset = wide(*point) - self.centre;
        self.n += 1.0;
        self.sum += offset;
        self.squares.add(&offset, 1.0);
    }

    fn normal(&self) -> Option<PointNormal> {
        if self.n < 3.0 {
            return None;
        }
        let mean = self.sum / self.n;
        let Smallest { values: [smallest, middle, largest], vector } =
            smallest_eigen(&(self.squares.matrix() / self.n - mean * mean.transpose()));
        // On a line every direction across it is as good as another.
        if middle.is_nan() || middle <= 1e-12 * largest {
            return None;
        }
        let curvature = (smallest / (smallest + middle + largest)).abs() as f32;
        Some(PointNormal { normal: narrow(&vector), curvature })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

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
            for point in &points {
                let [one, other] = [&by_grid, &by_tree].map(|around| around.scatter(point, &mut Vec::new()));
                assert!(one.n == other.n && (one.sum - other.sum).norm() < 1e-9, "{neighborhood:?}");
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
