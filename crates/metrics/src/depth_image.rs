//! What a scanner saw from its viewpoint, as a depth image.

use congruent_geometry::{Point, narrow, wide};
use nalgebra::Vector3;

/// Maximum number of pixels along one side; a wider view gets coarser pixels.
const MAX_SIDE: usize = 2000;
/// Number of the nine pixels around a point that must have been hit for the scanner to have looked there.
const MIN_SEEN: usize = 6;
/// Minimum depth as a fraction of the median depth; points beside or behind the scanner are left out.
const MIN_DEPTH: f32 = 0.05;

/// A perspective image of the depth of the closest surface seen around each pixel.
pub struct DepthImage {
    viewpoint: Point,
    /// Right, down, forward.
    axes: [Point; 3],
    /// Tangent of the angle spanned by one pixel.
    pixel: f32,
    corner: [f32; 2],
    size: [usize; 2],
    /// Smallest depth among the nine pixels around each; minus infinity where the scanner hardly looked.
    front: Vec<f32>,
    nearest: f32,
}

impl DepthImage {
    /// Creates the image of `points` from `viewpoint`, both in the same frame; a pixel is `pixel` data units wide at
    /// the median depth.
    #[must_use]
    pub fn new(points: &[Point], viewpoint: &Point, pixel: f64) -> Self {
        let middle = points.iter().map(|p| wide(*p)).sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let forward = (middle - wide(*viewpoint)).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let aside = if forward.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let right = forward.cross(&aside).normalize();
        let axes = [narrow(&right), narrow(&forward.cross(&right)), narrow(&forward)];
        let mut image = DepthImage {
            viewpoint: *viewpoint,
            axes,
            pixel: 1.0,
            corner: [0.0; 2],
            size: [0; 2],
            front: Vec::new(),
            nearest: 0.0,
        };
        image.expose(points, pixel as f32);
        image
    }

    /// Returns whether a point lies more than `by` in front of everything that was seen around its pixel.
    #[must_use]
    pub fn hides(&self, point: &Point, by: f32) -> bool {
        self.project(point).is_some_and(|(pixel, depth)| depth < self.front[pixel] - by)
    }

    fn expose(&mut self, points: &[Point], pixel: f32) {
        let mut depths: Vec<f32> = points.iter().map(|p| self.seen(p)[2]).collect();
        if depths.is_empty() {
            return;
        }
        let half = depths.len() / 2;
        let median = *depths.select_nth_unstable_by(half, f32::total_cmp).1;
        if median.is_nan() || median <= 0.0 {
            return;
        }
        self.nearest = MIN_DEPTH * median;
        self.frame(points, pixel / median);
        let mut depth = vec![f32::INFINITY; self.size[0] * self.size[1]];
        for (pixel, away) in points.iter().filter_map(|point| self.project(point)) {
            depth[pixel] = depth[pixel].min(away);
        }
        self.front = fronts(&depth, self.size[0]);
    }

    /// Chooses the corner, the size and, for a very wide view, coarser pixels.
    fn frame(&mut self, points: &[Point], pixel: f32) {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for seen in points.iter().map(|p| self.seen(p)).filter(|seen| seen[2] > self.nearest) {
            for axis in 0..2 {
                // Beyond 72 degrees off the axis, pixels would be stretched without bound.
                let tangent = (seen[axis] / seen[2]).clamp(-3.0, 3.0);
                low[axis] = low[axis].min(tangent);
                high[axis] = high[axis].max(tangent);
            }
        }
        let widest = (high[0] - low[0]).max(high[1] - low[1]);
        if !widest.is_finite() {
            return;
        }
        self.pixel = pixel.max(widest / MAX_SIDE as f32).max(f32::MIN_POSITIVE);
        self.corner = low.map(|v| v - self.pixel);
        self.size = std::array::from_fn(|axis| ((high[axis] - low[axis]) / self.pixel) as usize + 3);
    }

    /// Returns the right, down and forward coordinates relative to the viewpoint.
    fn seen(&self, point: &Point) -> Point {
        let offset: Point = std::array::from_fn(|axis| point[axis] - self.viewpoint[axis]);
        self.axes.each_ref().map(|a| a[0] * offset[0] + a[1] * offset[1] + a[2] * offset[2])
    }

    /// Returns the number of the pixel, and the depth.
    #[inline]
    fn project(&self, point: &Point) -> Option<(usize, f32)> {
        let [right, down, depth] = self.seen(point);
        if depth <= self.nearest {
            return None;
        }
        let place = [(right / depth - self.corner[0]) / self.pixel, (down / depth - self.corner[1]) / self.pixel];
        let inside = (0..2).all(|axis| place[axis] >= 0.0 && place[axis] < self.size[axis] as f32);
        inside.then(|| (place[1] as usize * self.size[0] + place[0] as usize, depth))
    }
}

/// Computes the front of each pixel of an image that is `width` wide; minus infinity at its rim.
fn fronts(depth: &[f32], width: usize) -> Vec<f32> {
    let mut fronts = vec![f32::NEG_INFINITY; depth.len()];
    let inside = fronts.iter_mut().enumerate().take(depth.len().saturating_sub(width)).skip(width);
    for (pixel, front) in inside.filter(|(pixel, _)| pixel % width != 0 && (pixel + 1) % width != 0) {
        let rows = [pixel - width, pixel, pixel + width].map(|middle| &depth[middle - 1..middle + 2]);
        let around = || rows.iter().copied().flatten().copied();
        if around().filter(|depth| depth.is_finite()).count() >= MIN_SEEN {
            *front = around().fold(f32::INFINITY, f32::min);
        }
    }
    fronts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of 60 by 60 points at depth 100, seen by a scanner at the origin that looks along +z.
    fn wall() -> DepthImage {
        let points: Vec<Point> = (0..3600).map(|i| [(i % 60) as f32 - 29.5, (i / 60) as f32 - 29.5, 100.0]).collect();
        DepthImage::new(&points, &[0.0; 3], 2.0)
    }

    #[test]
    fn only_what_stands_before_the_wall_hides_it() {
        let image = wall();
        for (point, expected) in [
            ([0.0, 0.0, 50.0], true),
            ([5.0, -3.0, 90.0], true),
            ([0.0, 0.0, 98.0], false),
            ([0.0, 0.0, 120.0], false),
            ([60.0, 0.0, 90.0], false),
            ([0.0, 0.0, -50.0], false),
            ([f32::NAN, 0.0, 50.0], false),
        ] {
            assert_eq!(image.hides(&point, 5.0), expected, "{point:?}");
        }
    }

    #[test]
    fn nothing_hides_nothing() {
        assert!(!DepthImage::new(&[], &[0.0; 3], 1.0).hides(&[0.0, 0.0, 1.0], 1.0));
        assert!(!DepthImage::new(&[[0.0; 3]], &[0.0; 3], 1.0).hides(&[0.0, 0.0, 1.0], 1.0));
    }
}
