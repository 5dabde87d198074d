//! A scanner whose way of sampling gives away where it was.

use super::camera::Camera;
use super::turning::Turning;
use nalgebra::Vector3;

/// A scanner that can be recognised by its points, before they are thinned.
#[derive(Clone, Debug)]
pub enum Scanner {
    /// It samples on a grid in an image: depth cameras, laser scanners with a lens.
    Camera(Camera),
    /// It turns in equal steps: spinning LiDARs, lasers on a tripod.
    Turning(Turning),
}

impl Scanner {
    /// Recognises the scanner; `None` if the points could be those of another one, or were resampled.
    pub(crate) fn of(spaced: &[Spaced]) -> Option<Scanner> {
        Camera::of(spaced).map(Scanner::Camera).or_else(|| Turning::of(spaced).map(Scanner::Turning))
    }
}

/// A point of a scan, centred, and the offset from it to its nearest other point, which is elsewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spaced {
    pub(crate) point: Vector3<f64>,
    pub(crate) offset: Vector3<f64>,
}

/// Returns the upper median of a list that is not empty.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

/// Returns the median deviation from the median.
pub(super) fn deviation_of(values: Vec<f64>) -> f64 {
    let middle = median(values.clone());
    median(values.into_iter().map(|v| (v - middle).abs()).collect())
}
