//! The surface that each pixel sees.
//!
//! Each triangle is tested against the rays of its box of pixels, exactly in space: nothing is interpolated in the
//! image, so triangles may be as large as a wall or reach behind the sensor.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Number of rows that one task fills.
const BAND_ROWS: usize = 16;
/// Surfaces nearer than this fraction of the mesh's largest coordinate are not seen; it only keeps divisions finite.
const NEAR: f64 = 1e-9;
/// Number of pixels by which boxes are widened against rounding; the exact test decides.
const SLACK: f64 = 1e-3;

/// A camera at the origin looking along +z.
pub(super) struct Pinhole {
    width: u32,
    height: u32,
    focal: f64,
}

impl Pinhole {
    /// Returns `None` for an image without pixels, or with 2³² or more, or for a view outside 0 to π radians.
    pub(super) fn new(width: u32, height: u32, horizontal_view: f64) -> Option<Self> {
        let sane = width > 0 && height > 0 && width.checked_mul(height).is_some();
        let view_is_sane = horizontal_view > 0.0 && horizontal_view < std::f64::consts::PI;
        let focal = f64::from(width) / 2.0 / (horizontal_view / 2.0).tan();
        (sane && view_is_sane).then_some(Pinhole { width, height, focal })
    }

    /// Returns the direction of a pixel's centre, scaled to z = 1.
    pub(super) fn ray(&self, column: u32, row: u32) -> Vector3<f64> {
        let x = f64::from(column) + 0.5 - f64::from(self.width) / 2.0;
        let y = f64::from(row) + 0.5 - f64::from(self.height) / 2.0;
        Vector3::new(x / self.focal, y / self.focal, 1.0)
    }
}

/// What a pixel sees.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// Depth along z; infinite if nothing is seen.
    pub(super) depth: f64,
    /// Normal of the triangle, of any length and on either side.
    pub(super) normal: Vector3<f64>,
}

/// Returns the nearest surface for each pixel, row by row. Of surfaces at the same depth the first in the list wins.
pub(super) fn nearest_hits(camera: &Pinhole, points: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<Hit> {
    let near = NEAR * points.iter().map(|p| p.amax()).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let corners = |t: &[u32; 3]| t.map(|i| points[i as usize]);
    let boxes: Vec<PixelBox> = triangles.par_iter().map(|t| PixelBox::new(camera, &corners(t), near)).collect();

    let width = camera.width as usize;
    let nothing = Hit { depth: f64::INFINITY, normal: Vector3::zeros() };
    let mut hits = vec![nothing; width * camera.height as usize];
    hits.par_chunks_mut(BAND_ROWS * width).enumerate().for_each(|(band, hits)| {
        let first = (band * BAND_ROWS) as u32;
        let end = first + (hits.len() / width) as u32;
        for (pixels, triangle) in boxes.iter().zip(triangles) {
            let rows = pixels.rows[0].max(first)..pixels.rows[1].min(end);
            if rows.is_empty() {
                continue;
            }
            let facet = Facet::new(&corners(triangle));
            for row in rows {
                for column in pixels.columns[0]..pixels.columns[1] {
                    let hit = &mut hits[(row - first) as usize * width + column as usize];
                    facet.meet(&camera.ray(column, row), near, hit);
                }
            }
        }
    });
    hits
}

/// A triangle prepared for many rays from the origin.
struct Facet {
    normal: Vector3<f64>,
    /// `normal · corner`, the same for every corner.
    offset: f64,
    /// Normals of the planes through the origin and an edge. Neighbours compute the same numbers for a shared edge with
    /// opposite signs, so no ray slips through between them.
    edges: [Vector3<f64>; 3],
}

impl Facet {
    fn new([a, b, c]: &[Vector3<f64>; 3]) -> Self {
        let normal = (b - a).cross(&(c - a));
        Facet { normal, offset: normal.dot(a), edges: [a.cross(b), b.cross(c), c.cross(a)] }
    }

    /// Replaces the hit of the pixel if the ray meets the triangle in front of what was seen so far.
    fn meet(&self, ray: &Vector3<f64>, near: f64, hit: &mut Hit) {
        let sides = self.edges.map(|edge| edge.dot(ray));
        if !(sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)) {
            return;
        }
        // A NaN, from a triangle seen edge-on or without area, fails both comparisons.
        let depth = self.offset / self.normal.dot(ray);
        if depth > near && depth < hit.depth {
            *hit = Hit { depth, normal: self.normal };
        }
    }
}

/// Half-open ranges of the pixels that may see a triangle.
struct PixelBox {
    columns: [u32; 2],
    rows: [u32; 2],
}

impl PixelBox {
    /// Computes the box around the part of the triangle in front of the near plane; empty for a triangle with a NaN.
    fn new(camera: &Pinhole, corners: &[Vector3<f64>; 3], near: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut include = |p: Vector3<f64>| {
            for k in 0..2 {
                low[k] = low[k].min(p[k] / p.z * camera.focal);
                high[k] = high[k].max(p[k] / p.z * camera.focal);
            }
        };
        if corners.iter().all(|p| p.iter().all(|v| v.is_finite())) {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if a.z > near {
                    include(a);
                }
                if (a.z > near) != (b.z > near) {
                    let crossing = a + (b - a) * ((near - a.z) / (b.z - a.z));
                    include(Vector3::new(crossing.x, crossing.y, near));
                }
            }
        }
        PixelBox {
            columns: pixels_between(low[0], high[0], camera.width),
            rows: pixels_between(low[1], high[1], camera.height),
        }
    }
}

/// Returns the pixels with centres between two image coordinates measured from the image's middle.
fn pixels_between(low: f64, high: f64, count: u32) -> [u32; 2] {
    let first_centre = 0.5 - f64::from(count) / 2.0;
    let limit = |v: f64| v.clamp(0.0, f64::from(count)) as u32;
    [limit((low - first_centre - SLACK).ceil()), limit((high - first_centre + SLACK).floor() + 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    #[test]
    fn boxes_miss_no_hit() {
        let camera = Pinhole::new(33, 25, 1.2).unwrap();
        let mut stream = Stream::new(1, 0);
        let mut seen = 0;
        for _ in 0..300 {
            // Around the sensor, so that many reach behind it.
            let mut corner = || Vector3::from_fn(|_, _| stream.between(-2.0, 2.0));
            let corners = [corner(), corner(), corner()];
            let hits = nearest_hits(&camera, &corners, &[[0, 1, 2]]);
            for (i, hit) in (0..).zip(&hits) {
                let mut expected = Hit { depth: f64::INFINITY, normal: Vector3::zeros() };
                Facet::new(&corners).meet(&camera.ray(i % 33, i / 33), 2.0 * NEAR, &mut expected);
                assert_eq!(hit.depth, expected.depth);
                seen += usize::from(hit.depth.is_finite());
            }
        }
        assert!(seen > 10_000, "{seen}");
    }
}
