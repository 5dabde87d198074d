//! An approximately nearest point of a cloud, looked up in a grid: a single memory access instead of an exact kd-tree
//! search.

use super::grid::Grid;
use crate::{Point, Spare};
use multiversion::multiversion;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Maximum number of cells, since more would cost more memory than a scan is worth; beyond it the cells grow.
const MAX_CELLS: f64 = 1.6e7;
const NOTHING: u32 = u32::MAX;
/// Distance from the centre of a cell to its corner, in cells, rounded up.
const HALF_DIAGONAL: f32 = 0.87;

/// Number of points looked up together.
const BLOCK: usize = 64;
/// Number of layers of cells filled at a time, so that the memory written to stays in the cache.
const LAYERS: usize = 16;
/// Number of cells filled together.
const LANES: usize = 8;

/// For every cell near a cloud, a point near the cell's centre.
///
/// Of the points in one cell only the one nearest to its centre is stored, and a query is answered for the centre of
/// its cell: a point returned may therefore be farther than the nearest one by up to two diagonals of a cell. Built
/// once in time proportional to occupied cells × (reach / cell)³.
pub struct NearestField {
    grid: Grid,
    /// By cell number, followed by a few entries that hold nothing.
    nearest: Vec<u32>,
}

impl NearestField {
    /// Builds cells of side `cell` (data units), filled as far as `reach` around the points.
    #[must_use]
    pub fn new(points: &[Point], cell: f64, reach: f64) -> Self {
        let grid = Grid::around(points, cell, reach, MAX_CELLS);
        let in_cells = reach as f32 / grid.side + HALF_DIAGONAL;
        // Anything nearer than this is within reach.
        let nobody = offer((in_cells * in_cells).next_up(), 0);
        let placed = representatives(&grid, points);
        let mut nearest = vec![0; grid.n_cells() + LANES];
        nearest[grid.n_cells()..].fill(NOTHING);
        let of_layers = grid.number([0, 0, LAYERS]).max(1);
        let slabs =
            nearest[..grid.n_cells()].par_chunks_mut(of_layers).zip((0..grid.size[2]).into_par_iter().step_by(LAYERS));
        let spare = Spare::<(Stamp, Vec<f64>)>::default();
        let fill = |(stamp, best): &mut (Stamp, Vec<f64>), nearest: &mut [u32], first: usize| {
            let layers = first..grid.size[2].min(first + LAYERS);
            best.clear();
            best.resize(nearest.len() + LANES, nobody);
            let above = placed.partition_point(|(place, _)| place[2] + in_cells < layers.start as f32);
            for (place, number) in &placed[above..] {
                if place[2] - in_cells > layers.end as f32 {
                    break;
                }
                stamp.place(&grid, &layers, place, in_cells);
                press(stamp, *number, nobody, best);
            }
            for (nearest, &best) in nearest.iter_mut().zip(&*best) {
                *nearest = if best == nobody { NOTHING } else { best.to_bits() as u32 };
            }
        };
        slabs.for_each(|(nearest, first)| spare.with(|workplace| fill(workplace, nearest, first)));
        NearestField { grid, nearest }
    }

    /// Returns a point near the centre of the cell that contains `query`; `None` beyond the reach.
    #[must_use]
    pub fn nearest(&self, query: &Point) -> Option<u32> {
        let mut found = [None];
        self.nearest_each(&[*query], &mut found);
        found[0]
    }

    /// Looks up points for many queries, as `nearest` does for one. The cells of many queries are computed before the
    /// first lookup is awaited: nearly all of the time is memory latency.
    ///
    /// # Panics
    /// If `found` is shorter than `queries`.
    pub fn nearest_each(&self, queries: &[Point], found: &mut [Option<u32>]) {
        let found = &mut found[..queries.len()];
        let mut cells = [0; BLOCK];
        for (queries, found) in queries.chunks(BLOCK).zip(found.chunks_mut(BLOCK)) {
            number_cells(&self.grid, queries, &mut cells);
            for (found, &cell) in found.iter_mut().zip(&cells) {
                let nearest = self.nearest[cell as usize];
                *found = (nearest != NOTHING).then_some(nearest);
            }
        }
    }
}

/// Computes the numbers of the cells that points are in; one past the last number for a point outside the grid.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn number_cells(grid: &Grid, points: &[Point], cells: &mut [u32]) {
    let size = grid.size.map(|n| n as u32);
    let outside = grid.n_cells() as u32;
    for (cell, point) in cells.iter_mut().zip(points) {
        let place = grid.place(point);
        let inside = (0..3).fold(true, |all, axis| all & (place[axis] >= 0.0) & (place[axis] < size[axis] as f32));
        // Rounded towards zero; far out the value saturates and is not used.
        let [x, y, z] = place.map(|v| v as i32 as u32);
        let number = z.wrapping_mul(size[1]).wrapping_add(y).wrapping_mul(size[0]).wrapping_add(x);
        *cell = if inside { number } else { outside };
    }
}

/// Returns, for each occupied cell, the point nearest to its centre with its coordinates in cells; sorted along z.
fn representatives(grid: &Grid, points: &[Point]) -> Vec<(Point, u32)> {
    let mut best: FxHashMap<usize, (f32, u32)> = FxHashMap::default();
    for (number, point) in (0u32..).zip(points) {
        let place = grid.place(point);
        let cell = place.map(|v| v as usize);
        let away: f32 = (0..3).map(|axis| (place[axis] - cell[axis] as f32 - 0.5).powi(2)).sum();
        let entry = best.entry(grid.number(cell)).or_insert((away, number));
        if away < entry.0 {
            *entry = (away, number);
        }
    }
    let placed = |(_, number): (f32, u32)| (grid.place(&points[number as usize]), number);
    let mut chosen: Vec<(Point, u32)> = best.into_values().map(placed).collect();
    chosen.sort_unstable_by(|(a, i), (b, j)| a[2].total_cmp(&b[2]).then(i.cmp(j)));
    chosen
}

/// The box of cells whose centres may be within reach of a point.
#[derive(Default)]
struct Stamp {
    /// The number of its first cell.
    first: usize,
    /// Increments of the number from row to row along y, and along z.
    steps: [usize; 2],
    /// Squared distances of the centres from the point along each axis, in cells; those along x in lanes, of which the
    /// unused ones at the end are infinite.
    from_x: Vec<[f32; LANES]>,
    from_y: Vec<f32>,
    from_z: Vec<f32>,
}

impl Stamp {
    /// Places the stamp around `place` as far as `reach`, both in cells, restricted to some layers of the grid; cells
    /// are numbered from the first cell of these layers.
    fn place(&mut self, grid: &Grid, layers: &Range<usize>, place: &Point, reach: f32) {
        let [xs, ys, zs] = [0, 1, 2].map(|axis| {
            let low = (place[axis] - reach - 0.5).ceil().max(0.0) as usize;
            let high = ((place[axis] + reach - 0.5).floor() + 1.0).max(0.0) as usize;
            low..high.min(grid.size[axis])
        });
        let from = |axis: usize, cell: usize| (cell as f32 + 0.5 - place[axis]).powi(2);
        let zs = zs.start.max(layers.start)..zs.end.min(layers.end);
        self.first = grid.number([xs.start, ys.start, zs.start - layers.start]);
        self.steps = [grid.size[0], grid.size[0] * grid.size[1]];
        self.from_x.clear();
        self.from_x.resize(xs.len().div_ceil(LANES), [f32::INFINITY; LANES]);
        self.from_x.as_flattened_mut().iter_mut().zip(xs).for_each(|(from_x, x)| *from_x = from(0, x));
        self.from_y.clear();
        self.from_y.extend(ys.map(|y| from(1, y)));
        self.from_z.clear();
        self.from_z.extend(zs.map(|z| from(2, z)));
    }
}

/// Packs a point and its squared distance, which is not negative, into the bits of one number: the nearer point is
/// less, and of equally near points the first. Taking the lesser of two such numbers is a single instruction.
#[inline(always)]
fn offer(distance_sq: f32, number: u32) -> f64 {
    f64::from_bits(u64::from(distance_sq.to_bits()) << u32::BITS | u64::from(number))
}

/// Offers a point to all cells of its stamp. Compiled for several instruction sets and chosen at run time; the bits are
/// the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn press(stamp: &Stamp, number: u32, nobody: f64, best: &mut [f64]) {
    for (z, from_z) in stamp.from_z.iter().enumerate() {
        for (y, from_y) in stamp.from_y.iter().enumerate() {
            let from_yz = from_y + from_z;
            if offer(from_yz, 0) >= nobody {
                continue;
            }
            let row = stamp.first + z * stamp.steps[1] + y * stamp.steps[0];
            let from_x = stamp.from_x.as_flattened();
            for (best, from_x) in best[row..][..from_x.len()].iter_mut().zip(from_x) {
                *best = best.min(offer(from_yz + from_x, number));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::wide;

    #[test]
    fn the_point_found_is_nearest_up_to_a_cell() {
        let mut stream = Stream::new(1, 0);
        let mut point = |side: f64| std::array::from_fn(|_| stream.between(-side, side) as f32);
        let points: Vec<Point> = (0..300).map(|_| point(10.0)).collect();
        let (cell, reach) = (0.5, 3.0);
        let field = NearestField::new(&points, cell, reach);
        for _ in 0..2000 {
            let query = point(14.0);
            let distance = |p: &Point| (wide(*p) - wide(query)).norm();
            let best = points.iter().map(distance).fold(f64::INFINITY, f64::min);
            let mut found = [Some(7); 2];
            field.nearest_each(&[query, query], &mut found);
            assert_eq!(found, [field.nearest(&query); 2]);
            match field.nearest(&query) {
                Some(found) => assert!(distance(&points[found as usize]) <= best + 2.0 * cell * 3f64.sqrt()),
                None => assert!(best > reach - 2.0 * cell * 3f64.sqrt()),
            }
        }
    }

    #[test]
    fn odd_clouds_are_fine() {
        assert!(NearestField::new(&[], 1.0, 2.0).nearest(&[0.0; 3]).is_none());
        let far_apart = [[0.0f32; 3], [1e6, 1e6, 1e6]];
        let field = NearestField::new(&far_apart, 1e-3, 2e-3);
        assert!(field.nearest(&[f32::NAN, 0.0, 0.0]).is_none() && field.nearest(&[1e30, 0.0, 0.0]).is_none());
        let mut found = [Some(0); 4];
        field.nearest_each(&[[f32::NAN; 3], [1e30, 0.0, 0.0], [0.0, -9.0, 0.0], far_apart[1]], &mut found);
        assert_eq!(found, [None, None, None, Some(1)]);
        NearestField::new(&[], 1.0, 2.0).nearest_each(&far_apart, &mut found);
        assert_eq!(found[..2], [None, None]);
    }
}
