//! A regular grid of cubic cells around a cloud.

use crate::Point;
use crate::bounds::bounds;

/// The position and size of the cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub(crate) low: Point,
    /// Side of a cell, data units.
    pub(crate) side: f32,
    /// Number of cells along each axis.
    pub(crate) size: [usize; 3],
}

impl Grid {
    /// Returns a grid that holds all points with a margin around them; the cells grow until there are at most
    /// `max_cells`. Without points there are no cells.
    ///
    /// # Panics
    /// If there are points and `side` is not above zero.
    pub(crate) fn around(points: &[Point], side: f64, margin: f64, max_cells: f64) -> Grid {
        let (low, high) = bounds(points);
        if points.is_empty() {
            return Grid { low: [0.0; 3], side: side as f32, size: [0; 3] };
        }
        assert!(side > 0.0, "the side of a cell is a length above zero");
        let length = |axis: usize| f64::from(high[axis]) - f64::from(low[axis]) + 2.0 * margin;
        let mut side = side;
        while (0..3).map(|axis| length(axis) / side + 1.0).product::<f64>() > max_cells {
            side *= 1.2;
        }
        Grid {
            low: low.map(|v| v - margin as f32),
            side: side as f32,
            size: std::array::from_fn(|axis| (length(axis) / side) as usize + 1),
        }
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns the coordinates of a point in units of cells.
    pub(crate) fn place(&self, point: &Point) -> Point {
        std::array::from_fn(|axis| (point[axis] - self.low[axis]) / self.side)
    }

    /// Returns the number of a cell; cells adjacent along x have consecutive numbers.
    pub(crate) fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }
}
