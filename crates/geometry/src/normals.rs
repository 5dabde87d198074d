//! Normals by principal component analysis of a neighbourhood.

use crate::{NeighborIndex, Point, narrow, sorted_eigen, wide};
use nalgebra::Matrix3;
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
    points.par_iter().map(|point| estimate(points, index, neighborhood, point)).collect()
}

fn estimate(points: &[Point], index: &NeighborIndex, neighborhood: Neighborhood, point: &Point) -> PointNormal {
    let mut scatter = Scatter::around(point);
    match neighborhood {
        Neighborhood::Nearest(k) => scatter.add_nearest(points, index, point, k),
        Neighborhood::Radius(radius) => scatter.add_within(points, index, point, radius),
        Neighborhood::RadiusAtLeast(radius, k) => {
            scatter.add_within(points, index, point, radius);
            if scatter.n < k as f64 {
                scatter = Scatter::around(point);
                scatter.add_nearest(points, index, point, k);
            }
        }
    }
    scatter.normal().unwrap_or_default()
}

/// First and second moments relative to a nearby point: without the shift, far coordinates would cancel.
struct Scatter {
    centre: Point,
    n: f64,
    sum: nalgebra::Vector3<f64>,
    squares: Matrix3<f64>,
}

impl Scatter {
    fn around(centre: &Point) -> Self {
        Scatter { centre: *centre, n: 0.0, sum: nalgebra::Vector3::zeros(), squares: Matrix3::zeros() }
    }

    fn add(&mut self, point: &Point) {
        let offset = wide(*point) - wide(self.centre);
        self.n += 1.0;
        self.sum += offset;
        self.squares += offset * offset.transpose();
    }

    fn add_nearest(&mut self, points: &[Point], index: &NeighborIndex, point: &Point, k: usize) {
        index.nearest_n(point, k).iter().for_each(|n| self.add(&points[n.index as usize]));
    }

    fn add_within(&mut self, points: &[Point], index: &NeighborIndex, point: &Point, radius: f64) {
        index.within(point, radius, |n| self.add(&points[n.index as usize]));
    }

    fn normal(&self) -> Option<PointNormal> {
        if self.n < 3.0 {
            return None;
        }
        let mean = self.sum / self.n;
        let eigen = sorted_eigen(&(self.squares / self.n - mean * mean.transpose()));
        let [smallest, middle, largest] = eigen.values;
        // On a line every direction across it is as good as another.
        if middle.is_nan() || middle <= 1e-12 * largest {
            return None;
        }
        let curvature = (smallest / (smallest + middle + largest)).abs() as f32;
        Some(PointNormal { normal: narrow(&eigen.vectors[0]), curvature })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
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
