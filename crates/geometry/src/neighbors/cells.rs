//! Points sorted by the cells of a grid, so that the neighbours of a position lie in a few contiguous runs.
//!
//! If many points are queried for all of their many neighbours, reading runs sequentially is several times faster than
//! walking a tree, and the work on a run can use whole vector registers.

use super::grid::Grid;
use crate::Point;
use multiversion::multiversion;
use rayon::prelude::*;
use std::ops::Range;

/// Maximum number of cells per point, which bounds the table by the size of the cloud; beyond it the cells grow.
const MAX_CELLS_PER_POINT: f64 = 16.0;
/// Maximum number of cells: their numbers fit into 31 bits.
const MAX_CELLS: f64 = (1u64 << 31) as f64;
/// Fraction of a cell by which runs reach farther than requested, so that rounding loses no point: this much …
const SLACK: f32 = 1e-3;
/// … or this much per cell along the longest side, if that is more.
const SLACK_PER_CELL: f32 = 5e-7;

/// Minimum number of points that one thread takes at a time.
const POINTS_AT_A_TIME: usize = 4096;
/// Maximum number of rows of cells in the neighbourhood of a row, itself included.
const ROWS_AROUND: usize = 9;

/// The points of a cloud, ordered by cell.
pub struct Cells {
    grid: Grid,
    /// For each cell its first place in the order, and finally the end of the order.
    starts: Vec<u32>,
    order: Vec<u32>,
    crowding: f64,
    slack: f32,
}

impl Cells {
    /// Sorts points into cells of about this side (data units); within a cell they keep their order.
    ///
    /// # Panics
    /// With 2³² points or more, or if there are points and `side` is not above zero.
    #[must_use]
    pub fn new(points: &[Point], side: f64) -> Cells {
        let n = u32::try_from(points.len()).expect("a cloud has fewer than 2^32 points");
        let grid = Grid::around(points, side, 0.0, (MAX_CELLS_PER_POINT * f64::from(n) + 64.0).min(MAX_CELLS));
        let mut cells = vec![0; points.len()];
        let parts = cells.par_chunks_mut(POINTS_AT_A_TIME).zip(points.par_chunks(POINTS_AT_A_TIME));
        parts.for_each(|(cells, points)| number_cells(points, &grid, cells));
        // First the end of each cell; filling backwards turns it into the start.
        let mut starts = vec![0u32; grid.n_cells() + 1];
        let mut pairs = 0u64;
        for &cell in &cells {
            let count = &mut starts[cell as usize];
            // The difference between consecutive squares.
            pairs += 2 * u64::from(*count) + 1;
            *count += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut order = vec![0; points.len()];
        for (number, &cell) in (0..n).zip(&cells).rev() {
            let start = &mut starts[cell as usize];
            *start -= 1;
            order[*start as usize] = number;
        }
        let longest = grid.size.into_iter().max().unwrap_or(0);
        let slack = SLACK.max(SLACK_PER_CELL * longest as f32);
        Cells { grid, starts, order, crowding: pairs as f64 / f64::from(n.max(1)), slack }
    }

    /// Returns the mean number of points in the cell of a point, which determines how long a search takes.
    pub(crate) fn crowding(&self) -> f64 {
        self.crowding
    }

    /// Returns the positions of the points, sorted by cell.
    #[inline]
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Returns the numbers of the rows of cells along x that hold points, ascending.
    pub(crate) fn occupied_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let along = self.grid.size[0].max(1);
        (0..self.grid.n_cells() / along).filter(|row| !self.places_in_row(*row).is_empty())
    }

    /// Returns the places in the order of the points of a row of cells.
    pub(crate) fn places_in_row(&self, row: usize) -> Range<usize> {
        let along = self.grid.size[0];
        self.starts[row * along] as usize..self.starts[(row + 1) * along] as usize
    }

    /// Visits the occupied cells of a row, each with the places of its points in the order and the runs of the
    /// surrounding cells, some of which are empty.
    pub(crate) fn row_blocks(&self, row: usize, mut visit: impl FnMut(Range<usize>, &[Range<usize>])) {
        let [along, ny, nz] = self.grid.size;
        let around = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        let (ys, zs) = (around(row % ny, ny), around(row / ny, nz));
        let mut firsts = [0; ROWS_AROUND];
        let beside = zs.flat_map(|z| ys.clone().map(move |y| (z * ny + y) * along));
        let n_beside = firsts.iter_mut().zip(beside).map(|(own, first)| *own = first).count();
        let run = |first: usize, xs: Range<usize>| {
            self.starts[first + xs.start] as usize..self.starts[first + xs.end] as usize
        };
        let mut runs = [const { 0..0 }; ROWS_AROUND];
        let runs = &mut runs[..n_beside];
        for x in 0..along {
            let members = run(row * along, x..x + 1);
            if !members.is_empty() {
                runs.iter_mut().zip(firsts).for_each(|(own, first)| *own = run(first, around(x, along)));
                visit(members, runs);
            }
        }
    }

    /// Visits the runs of the order, ascending, that hold all points within `radius` (data units) of a position: those
    /// of the block of cells around it. If the block is only a few cells wide, a tighter selection costs more than it
    /// saves.
    #[inline]
    pub(crate) fn around(&self, centre: &Point, radius: f64, mut visit: impl FnMut(Range<usize>)) {
        let Grid { side, size, .. } = self.grid;
        let place = self.grid.place(centre);
        let reach = radius as f32 / side + self.slack;
        let span = |axis: usize| {
            let low = (place[axis] - reach).max(0.0) as usize;
            let high = ((place[axis] + reach).max(-1.0) + 1.0) as usize;
            low.min(size[axis])..high.min(size[axis])
        };
        let [xs, ys, zs] = [0, 1, 2].map(span);
        if xs.is_empty() {
            return;
        }
        for z in zs {
            for y in ys.clone() {
                let row = self.grid.number([0, y, z]);
                let (start, end) = (self.starts[row + xs.start] as usize, self.starts[row + xs.end] as usize);
                if start < end {
                    visit(start..end);
                }
            }
        }
    }

    /// Returns runs of the order, ascending, that hold all points within `radius` (data units) of a position, and
    /// others.
    #[inline]
    pub fn runs(&self, centre: &Point, radius: f64) -> impl Iterator<Item = Range<usize>> + '_ {
        let Grid { side, size, .. } = self.grid;
        let place = self.grid.place(centre);
        let reach = radius as f32 / side + self.slack;
        let span = move |axis: usize, half: f32| {
            let low = (place[axis] - half).max(0.0) as usize;
            let high = ((place[axis] + half).max(-1.0) + 1.0) as usize;
            low.min(size[axis])..high.min(size[axis])
        };
        // Distance of a layer of cells from the position.
        let gap = move |axis: usize, cell: usize| {
            let low = cell as f32;
            (low - place[axis]).max(place[axis] - low - 1.0).max(0.0)
        };
        span(2, reach).flat_map(move |z| {
            let left_z = reach * reach - gap(2, z).powi(2);
            span(1, reach).filter_map(move |y| {
                let left = left_z - gap(1, y).powi(2);
                if left < 0.0 {
                    return None;
                }
                let along = span(0, left.sqrt());
                let start = self.starts[self.grid.number([along.start, y, z])] as usize;
                let end = self.starts[self.grid.number([along.end, y, z])] as usize;
                (start < end).then_some(start..end)
            })
        })
    }
}

/// Computes the number of the cell of each point of the cloud that the grid was laid around.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn number_cells(points: &[Point], grid: &Grid, cells: &mut [u32]) {
    let last = grid.size.map(|n| n as i32 - 1);
    let [row, layer] = [grid.size[0] as u32, (grid.size[0] * grid.size[1]) as u32];
    for (cell, point) in cells.iter_mut().zip(points) {
        let place = grid.place(point);
        let [x, y, z]: [u32; 3] = std::array::from_fn(|axis| (place[axis] as i32).min(last[axis]) as u32);
        *cell = z * layer + y * row + x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn the_runs_hold_every_neighbour() {
        let mut stream = Stream::new(4, 0);
        let mut point = || -> Point { std::array::from_fn(|_| stream.between(-10.0, 10.0) as f32) };
        let points: Vec<Point> = (0..700).map(|_| point()).collect();
        for (side, radius) in [(0.7, 2.0), (5.0, 3.0), (100.0, 1.0), (1e-6, 4.0)] {
            let cells = Cells::new(&points, side);
            for _ in 0..200 {
                let centre = point().map(|v| v * 1.2);
                let runs: Vec<Range<usize>> = cells.runs(&centre, radius).collect();
                assert!(runs.windows(2).all(|w| w[0].end <= w[1].start));
                let found: Vec<u32> = runs.into_iter().flat_map(|run| cells.order()[run].to_vec()).collect();
                for (i, p) in (0u32..).zip(&points) {
                    let distance_sq: f32 = (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum();
                    assert!(distance_sq > (radius * radius) as f32 || found.contains(&i), "{side} {radius}");
                }
            }
        }
    }

    #[test]
    fn every_point_is_in_the_order_once() {
        let points = [[0.0f32, 0.0, 0.0], [1e6, 0.0, 0.0], [0.0, 0.0, 0.0], [5.0, 5.0, -7.0]];
        let mut order = Cells::new(&points, 1.0).order().to_vec();
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2, 3]);
        assert_eq!(Cells::new(&[], 1.0).runs(&[0.0; 3], 5.0).count(), 0);
    }
}
