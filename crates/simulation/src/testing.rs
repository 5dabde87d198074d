//! Small surfaces, ready to be queried, for the tests of other crates.

use congruent_geometry::random::Stream;
use congruent_geometry::{NeighborIndex, Neighborhood, Point, Surface, estimate_normals, narrow, resolution, wide};
use nalgebra::{UnitQuaternion, Vector3};

/// Points with normals estimated from their twelve nearest points and turned to +z.
#[must_use]
pub fn surface(points: Vec<Point>) -> Surface {
    let index = NeighborIndex::new(&points);
    let normals = estimate_normals(&points, &index, Neighborhood::Nearest(12))
        .iter()
        .map(|n| if n.normal[2] < 0.0 { n.normal.map(|v| -v) } else { n.normal })
        .collect();
    let resolution = resolution(&points, &index).map_or(1.0, |r| r.mean);
    Surface::new(points, normals, index, resolution)
}

/// `side`² points at integer x and y around the origin, with the given heights.
pub fn height_field(side: u16, height: impl Fn(f64, f64) -> f64) -> Surface {
    let at = |i: u16| f64::from(i) - f64::from(side / 2);
    let points = (0..side * side).map(|i| {
        let (x, y) = (at(i % side), at(i / side));
        narrow(&Vector3::new(x, y, height(x, y)))
    });
    surface(points.collect())
}

/// A flat grid.
#[must_use]
pub fn plane(side: u16) -> Surface {
    height_field(side, |_, _| 0.0)
}

/// `side`² irregular points, one per unit square, over random bumps.
#[must_use]
pub fn bumpy(side: u16, seed: u64) -> Surface {
    let mut stream = Stream::new(seed, 0);
    let half = f64::from(side) / 2.0;
    let bumps: Vec<[f64; 4]> = (0..side)
        .map(|_| {
            let centre = (stream.between(-half, half), stream.between(-half, half));
            [centre.0, centre.1, stream.between(-3.0, 3.0), stream.between(1.5, 4.0)]
        })
        .collect();
    let height = |x: f64, y: f64| -> f64 {
        bumps.iter().map(|[cx, cy, h, w]| h * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * w * w)).exp()).sum()
    };
    let points = (0..side * side).map(|i| {
        let x = f64::from(i % side) + stream.unit() - half;
        let y = f64::from(i / side) + stream.unit() - half;
        narrow(&Vector3::new(x, y, height(x, y)))
    });
    surface(points.collect())
}

/// The rotation of [`turned`].
#[must_use]
pub fn turn(seed: u64) -> UnitQuaternion<f64> {
    Stream::new(seed, 1).rotation()
}

/// The same surface in a random orientation, including its normals.
#[must_use]
pub fn turned(surface: &Surface, seed: u64) -> Surface {
    let turn = turn(seed);
    let rotated = |all: &[Point]| -> Vec<Point> { all.iter().map(|p| narrow(&(turn * wide(*p)))).collect() };
    let points = rotated(surface.points());
    let index = NeighborIndex::new(&points);
    Surface::new(points, rotated(surface.normals()), index, surface.resolution())
}

/// Does the work on so many threads.
///
/// # Panics
/// If the system has no threads left.
pub fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("the system has threads left").install(work)
}
