//! The nearest point of a cloud, looked up in a grid: what kd-trees answer exactly, answered in one memory access.

use crate::Point;
use crate::grid::Grid;
use multiversion::multiversion;
use rustc_hash::FxHashMap;

/// More cells than this would cost more memory than a scan is worth; the cells grow instead.
const MAX_CELLS: f64 = 1.6e7;
const NOTHING: u32 = u32::MAX;
/// From the middle of a cell to its corner, in cells, rounded up.
const HALF_DIAGONAL: f32 = 0.87;

/// Points that are looked up together.
const BLOCK: usize = 64;
/// Cells that are filled together.
const LANES: usize = 8;

/// For every cell near a cloud, a point near to the cell's centre.
///
/// Of the points in one cell only the one nearest to its centre is remembered, and a query is answered for the centre
/// of its cell: so a point returned may be farther than the nearest one by up to two diagonals of a cell. Built once in
/// time proportional to occupied cells × (reach / cell)³.
pub struct NearestField {
    grid: Grid,
    /// By the number of the cell, and nothing in a few more.
    nearest: Vec<u32>,
}

impl NearestField {
    /// Cells of side `cell` (data units), filled as far as `reach` around the points.
    #[must_use]
    pub fn new(points: &[Point], cell: f64, reach: f64) -> Self {
        let grid = Grid::around(points, cell, reach, MAX_CELLS);
        let mut nearest = vec![NOTHING; grid.n_cells() + LANES];
        let mut distance_sq = vec![f32::INFINITY; nearest.len()];
        let in_cells = reach as f32 / grid.side + HALF_DIAGONAL;
        for number in representatives(&grid, points) {
            let place = grid.place(&points[number as usize]);
            stamp((&grid, &mut nearest, &mut distance_sq), number, place, in_cells);
        }
        NearestField { grid, nearest }
    }

    /// A point near to the middle of the cell that `query` is in; `None` beyond the reach.
    #[must_use]
    pub fn nearest(&self, query: &Point) -> Option<u32> {
        let mut found = [None];
        self.nearest_each(&[*query], &mut found);
        found[0]
    }

    /// The same for many points. Where they are looked up is known of many before the first is waited for: nearly all of the
    /// time is that of the memory.
    ///
    /// # Panics
    /// Where `found` is shorter than `queries`.
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

/// Numbers of the cells that points are in; that after the last for a point in none.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn number_cells(grid: &Grid, points: &[Point], cells: &mut [u32]) {
    let size = grid.size.map(|n| n as u32);
    let outside = grid.n_cells() as u32;
    for (cell, point) in cells.iter_mut().zip(points) {
        let place = grid.place(point);
        let inside = (0..3).fold(true, |all, axis| all & (place[axis] >= 0.0) & (place[axis] < size[axis] as f32));
        // Rounded towards zero; far out it is cut off, and not used.
        let [x, y, z] = place.map(|v| v as i32 as u32);
        let number = z.wrapping_mul(size[1]).wrapping_add(y).wrapping_mul(size[0]).wrapping_add(x);
        *cell = if inside { number } else { outside };
    }
}

/// Of each occupied cell the point nearest to its centre, ascending.
fn representatives(grid: &Grid, points: &[Point]) -> Vec<u32> {
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
    let mut chosen: Vec<u32> = best.into_values().map(|(_, number)| number).collect();
    chosen.sort_unstable();
    chosen
}

/// Offers a point, whose place is given in cells, to all cells whose centres are within `reach` (in cells). Compiled once for
/// each instruction set and chosen at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn stamp((grid, nearest, distance_sq): (&Grid, &mut [u32], &mut [f32]), number: u32, place: [f32; 3], reach: f32) {
    let [xs, ys, zs] = [0, 1, 2].map(|axis| {
        let low = (place[axis] - reach - 0.5).ceil().max(0.0) as usize;
        let high = ((place[axis] + reach - 0.5).floor() + 1.0).max(0.0) as usize;
        low..high.min(grid.size[axis])
    });
    let from = |axis: usize, cell: usize| (cell as f32 + 0.5 - place[axis]).powi(2);
    let reach_sq = reach * reach;
    for first in xs.clone().step_by(LANES) {
        let from_x =
            std::array::from_fn(|lane| if first + lane < xs.end { from(0, first + lane) } else { f32::INFINITY });
        for z in zs.clone() {
            for y in ys.clone() {
                let from_yz = from(1, y) + from(2, z);
                if from_yz <= reach_sq {
                    let row = grid.number([first, y, z]);
                    let lanes = row..row + LANES;
                    offer(number, from_yz, &from_x, reach_sq, (&mut nearest[lanes.clone()], &mut distance_sq[lanes]));
                }
            }
        }
    }
}

/// To some cells that follow each other.
#[inline(always)]
fn offer(
    number: u32,
    from_yz: f32,
    from_x: &[f32; LANES],
    reach_sq: f32,
    (nearest, distance_sq): (&mut [u32], &mut [f32]),
) {
    let (Some(nearest), Some(distance_sq)) = (nearest.first_chunk_mut(), distance_sq.first_chunk_mut()) else { return };
    // Copies, so that the whole of it is done in registers.
    let (known, distance): ([u32; LANES], [f32; LANES]) = (*nearest, *distance_sq);
    let away = from_x.map(|from_x| from_yz + from_x);
    let is_nearer: [bool; LANES] = std::array::from_fn(|lane| (away[lane] <= reach_sq) & (away[lane] < distance[lane]));
    *nearest = std::array::from_fn(|lane| if is_nearer[lane] { number } else { known[lane] });
    *distance_sq = std::array::from_fn(|lane| if is_nearer[lane] { away[lane] } else { distance[lane] });
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
