//! What tests of several descriptors need.

use congruent_geometry::{NeighborIndex, Point, Surface, narrow};
use congruent_simulation::testing::surface;
use nalgebra::Vector3;

/// A flat disc of radius 1 with evenly spread points (a golden spiral), the first at its centre.
pub(crate) fn disc(n: u16) -> Surface {
    let spiral = (0..n).map(|i| {
        let (angle, r) = (f64::from(i) * 2.399_963_229_728_653, ((f64::from(i) + 0.5) / f64::from(n)).sqrt());
        narrow(&Vector3::new(r * angle.cos(), r * angle.sin(), 0.0))
    });
    surface(std::iter::once([0.0; 3]).chain(spiral).collect())
}

/// The same surface with other normals.
fn with_normals(surface: &Surface, change: impl Fn(Point) -> Point) -> Surface {
    let points = surface.points().to_vec();
    let index = NeighborIndex::new(&points);
    let normals = surface.normals().iter().map(|n| change(*n)).collect();
    Surface::new(points, normals, index, surface.resolution())
}

/// The same surface with reversed normals.
pub(crate) fn flipped(surface: &Surface) -> Surface {
    with_normals(surface, |normal| normal.map(|v| -v))
}

/// The same surface with no valid normal.
pub(crate) fn without_normals(surface: &Surface) -> Surface {
    with_normals(surface, |_| [0.0; 3])
}

/// Euclidean distance.
pub(crate) fn distance(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>().sqrt()
}
