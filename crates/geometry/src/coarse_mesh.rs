//! Points on the triangles of a mesh that has too few vertices to be registered by them, as CAD models have.

use crate::{Point, RawScan, narrow};
use nalgebra::Vector3;

/// Length of a triangle's longest edge, as a fraction of the extent of the mesh, above which the triangle is large.
const LARGE: f64 = 1.0 / 40.0;
/// Fraction of the area that large triangles have to make up. Meshes of scans have hardly any.
const MOSTLY: f64 = 0.5;
/// Fraction of the points that have to be corners of triangles; otherwise the points are what was measured.
const CORNERS: f64 = 0.5;
/// Number of points on a mesh: enough for any sampling budget of the presets.
const SAMPLES: usize = 60_000;
/// Number of points from which on a mesh is never coarse.
const MANY_POINTS: usize = 200_000;
/// Irrational steps of an evenly spread sequence in the unit square (Roberts 2018).
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// Returns evenly spread points on the triangles, with the normals of their triangles, if at least half of the mesh's area
/// consists of triangles larger than a fortieth of its extent; `None` for all other meshes and for point clouds, also if
/// a few triangles lie among them.
///
/// The points replace the vertices and the triangles. Triangles with a corner that is not finite are skipped.
#[must_use]
pub fn samples_of_coarse_mesh(raw: &RawScan) -> Option<RawScan> {
    if raw.triangles.is_empty() || raw.points.len() >= MANY_POINTS || !mostly_corners(raw) {
        return None;
    }
    let triangles: Vec<Triangle> = raw.triangles.iter().filter_map(|corners| Triangle::new(raw, corners)).collect();
    let used = || triangles.iter().flat_map(|triangle| triangle.corners);
    let extent = used().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p))
        - used().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p));
    let area: f64 = triangles.iter().map(|triangle| triangle.area).sum();
    let is_large = |triangle: &&Triangle| triangle.longest_edge() > LARGE * extent.max();
    let large: f64 = triangles.iter().filter(is_large).map(|triangle| triangle.area).sum();
    if area <= 0.0 || !area.is_finite() || large < MOSTLY * area {
        return None;
    }
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(SAMPLES);
    let mut normals = Vec::with_capacity(SAMPLES);
    let (mut end, mut taken) = (0.0, 0usize);
    for triangle in &triangles {
        end += triangle.area;
        let normal = triangle.normal();
        while ((taken as f64 + 0.5) / SAMPLES as f64) * area < end && taken < SAMPLES {
            points.push(triangle.point(STEPS.map(|step| (step * taken as f64).fract())).into());
            normals.push(normal);
            taken += 1;
        }
    }
    let (viewpoint, unread) = (raw.viewpoint, raw.unread.clone());
    Some(RawScan { points: points.into(), normals: Some(normals), triangles: Vec::new(), viewpoint, unread })
}

fn mostly_corners(raw: &RawScan) -> bool {
    let mut is_corner = vec![false; raw.points.len()];
    raw.triangles.as_flattened().iter().for_each(|&i| is_corner[i as usize] = true);
    is_corner.iter().filter(|is_corner| **is_corner).count() as f64 >= CORNERS * raw.points.len() as f64
}

struct Triangle {
    corners: [Vector3<f64>; 3],
    area: f64,
}

impl Triangle {
    /// `None` if a corner is not finite or the triangle has no area.
    fn new(raw: &RawScan, corners: &[u32; 3]) -> Option<Triangle> {
        let corners = corners.map(|i| Vector3::from(raw.points.at(i as usize)));
        let [a, b, c] = corners;
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        (area > 0.0 && area.is_finite()).then_some(Triangle { corners, area })
    }

    fn longest_edge(&self) -> f64 {
        let [a, b, c] = self.corners;
        [b - a, c - b, a - c].map(|edge| edge.norm()).into_iter().fold(0.0, f64::max)
    }

    fn normal(&self) -> Point {
        let [a, b, c] = self.corners;
        narrow(&(b - a).cross(&(c - a)).normalize())
    }

    /// The point at a place in the unit square, whose upper half is folded onto the lower one.
    fn point(&self, [u, v]: [f64; 2]) -> Vector3<f64> {
        let [a, b, c] = self.corners;
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 4 by 2 by 1 with an upright edge at the origin, two triangles a side.
    fn cuboid() -> RawScan {
        let points =
            (0..8u8).map(|i| [4.0 * f64::from(i & 1), 2.0 * f64::from(i >> 1 & 1), f64::from(i >> 2)]).collect();
        let sides = [[0u32, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        RawScan { points, triangles, ..RawScan::default() }
    }

    #[test]
    fn a_box_of_twelve_triangles_is_covered_evenly() {
        let sampled = samples_of_coarse_mesh(&cuboid()).unwrap();
        assert_eq!((sampled.points.len(), sampled.triangles.len()), (SAMPLES, 0));
        let normals = sampled.normals.unwrap();
        let on_top = sampled.points.iter().filter(|p| (p[2] - 1.0).abs() < 1e-9).count() as f64;
        // The top has 8 of 28 units of area.
        assert!((on_top / SAMPLES as f64 - 8.0 / 28.0).abs() < 0.01, "{on_top}");
        let corner = sampled.points.iter().filter(|p| p[2] > 0.999_999 && p[0] < 1.0 && p[1] < 1.0).count() as f64;
        assert!((corner / on_top - 0.125).abs() < 0.02, "{corner} of {on_top}");
        for (point, normal) in sampled.points.iter().zip(&normals) {
            let axis = (0..3).find(|&axis| normal[axis].abs() > 0.999).unwrap();
            assert!([0.0, [4.0, 2.0, 1.0][axis]].iter().any(|side| (point[axis] - side).abs() < 1e-9));
        }
    }

    #[test]
    fn meshes_of_scans_and_clouds_stay_as_they_are() {
        let n = 60u32;
        let points = (0..n * n).map(|i| [f64::from(i % n), f64::from(i / n), 0.1 * f64::from(i % 7)]).collect();
        let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
        let triangles = cells.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect();
        let mut mesh = RawScan { points, triangles, ..RawScan::default() };
        assert!(samples_of_coarse_mesh(&mesh).is_none());
        mesh.triangles = vec![[0, n - 1, n * n - 1], [0, n * n - 1, n * (n - 1)]];
        assert!(samples_of_coarse_mesh(&mesh).is_none());
        mesh.triangles.clear();
        assert!(samples_of_coarse_mesh(&mesh).is_none());
        let mut broken = cuboid();
        broken.points.edited().iter_mut().for_each(|p| p[0] = f64::NAN);
        assert!(samples_of_coarse_mesh(&broken).is_none());
    }
}
