//! The other points around a keypoint, searched once and kept in a buffer that each thread reuses.

use congruent_geometry::{Surface, wide};
use nalgebra::Vector3;
use std::cell::Cell;

/// A point near a keypoint that does not coincide with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// Position in the surface.
    pub(crate) index: u32,
    /// Length of the offset, above zero.
    pub(crate) distance: f64,
    /// Offset from the keypoint.
    pub(crate) offset: Vector3<f64>,
}

thread_local! {
    static BUFFER: Cell<Vec<Near>> = const { Cell::new(Vec::new()) };
}

/// Passes the points within `radius` (inclusive) of a surface point to `work`, without those that coincide with it.
pub(crate) fn with_neighborhood<T>(
    surface: &Surface,
    keypoint: u32,
    radius: f64,
    work: impl FnOnce(&[Near]) -> T,
) -> T {
    let mut found = BUFFER.take();
    found.clear();
    let centre = surface.points()[keypoint as usize];
    surface.index().within(&centre, radius, |n| {
        let offset = wide(surface.points()[n.index as usize]) - wide(centre);
        let distance = offset.norm();
        if distance > 0.0 {
            found.push(Near { index: n.index, distance, offset });
        }
    });
    let result = work(&found);
    BUFFER.set(found);
    result
}
