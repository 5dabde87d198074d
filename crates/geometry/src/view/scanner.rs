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

/// Standard deviation of a normal distribution, as a multiple of the median deviation.
const SIGMA: f64 = 1.4826;
/// Residual, in standard deviations, at which the weight of a point is one half.
const HALF_WEIGHT: f64 = 1.5;

/// How far a number is from the median of all, and how much it counts in a fit: the less, the farther.
#[derive(Clone, Copy)]
pub(super) struct Weighted {
    pub(super) residual: f64,
    pub(super) weight: f64,
}

/// Weights numbers, of which there is at least one, for a fit that outliers do not disturb.
pub(super) fn weighted(numbers: Vec<f64>) -> Vec<Weighted> {
    let middle = median(numbers.clone());
    let sigma = (SIGMA * deviation_of(numbers.clone())).max(1e-9);
    let weight = |residual: f64| 1.0 / (1.0 + (residual / (HALF_WEIGHT * sigma)).powi(2));
    numbers.into_iter().map(|v| v - middle).map(|residual| Weighted { residual, weight: weight(residual) }).collect()
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
