//! The result of a scan.

use congruent_geometry::{RawScan, RigidTransform};

/// The returns of one view, in the sensor's frame, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeScan {
    /// One for each pixel that returned something; the viewpoint is the origin.
    pub points: Vec<[f64; 3]>,
    /// The pixel of each point: row · width + column.
    pub pixels: Vec<u32>,
    /// Number of pixels across.
    pub width: u32,
    /// Number of pixels down.
    pub height: u32,
    /// The sensor's true pose.
    pub world_from_sensor: RigidTransform,
}

impl RangeScan {
    /// Returns the points alone.
    #[must_use]
    pub fn cloud(&self) -> RawScan {
        RawScan { points: self.points.clone().into(), ..RawScan::default() }
    }

    /// Returns the points with the triangles between neighbouring pixels. These face the sensor; noise along the rays
    /// cannot flip them.
    ///
    /// Pixels are connected if their depths differ by at most `max_jump` data units. A square is split along the
    /// diagonal with the smaller jump.
    #[must_use]
    pub fn meshed(&self, max_jump: f64) -> RawScan {
        let mut at = vec![None; self.width as usize * self.height as usize];
        for (i, &pixel) in (0u32..).zip(&self.pixels) {
            at[pixel as usize] = Some(i);
        }
        let at = |row: u32, column: u32| at[row as usize * self.width as usize + column as usize];
        let mut scan = self.cloud();
        for row in 1..self.height {
            for column in 1..self.width {
                let square = [at(row - 1, column - 1), at(row, column - 1), at(row, column), at(row - 1, column)];
                scan.triangles.extend(self.triangles_of(square, max_jump).into_iter().flatten());
            }
        }
        scan
    }

    /// Returns up to two triangles of a square, whose corners run from the upper left downwards and around.
    fn triangles_of(&self, square: [Option<u32>; 4], max_jump: f64) -> [Option<[u32; 3]>; 2] {
        let depth = |i: u32| self.points[i as usize][2];
        let jump = |a: Option<u32>, b: Option<u32>| match (a, b) {
            (Some(a), Some(b)) => (depth(a) - depth(b)).abs(),
            _ => f64::INFINITY,
        };
        let [a, b, c, d] = square;
        let halves = if jump(a, c) <= jump(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        halves.map(|[p, q, r]| {
            let connected = jump(p, q) <= max_jump && jump(q, r) <= max_jump && jump(r, p) <= max_jump;
            connected.then_some([p?, q?, r?])
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::scanner::{RangeNoise, VirtualScanner};
    use crate::shapes::{figurine, plane};
    use nalgebra::Vector3;

    #[test]
    fn a_plane_is_meshed_without_gaps() {
        let wall = plane(10.0, 1);
        let mut scanner = VirtualScanner::orbit(&wall, 0.3, 0.9, 2.0, 40);
        scanner.horizontal_view /= 4.0;
        assert_eq!(scanner.scan(&wall, 0).meshed(1.0).triangles.len(), 39 * 39 * 2);
        assert!(scanner.scan(&wall, 0).meshed(0.0).triangles.is_empty());
    }

    #[test]
    fn triangles_face_the_sensor_and_do_not_bridge_jumps() {
        let mesh = figurine(1);
        let mut scanner = VirtualScanner::orbit(&mesh, 1.0, 0.2, 3.0, 150);
        scanner.noise = RangeNoise::gaussian(0.1);
        let raw = scanner.scan(&mesh, 5).meshed(3.0);
        assert!(raw.triangles.len() > raw.points.len());
        for t in &raw.triangles {
            let [a, b, c] = t.map(|i| Vector3::from(raw.points.at(i as usize)));
            assert!((b - a).cross(&(c - a)).dot(&a) < 0.0);
            assert!((a.z - b.z).abs().max((b.z - c.z).abs()).max((c.z - a.z).abs()) <= 3.0);
        }
    }
}
