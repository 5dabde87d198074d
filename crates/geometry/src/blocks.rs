//! The points of a cell beside all points around it, gathered once for all of them.
//!
//! Where every point of a cloud is asked for the same thing, those of one cell look at the same places. What they look at is
//! laid in rows of whole vector registers, so that it can be gone through without a branch.

use crate::{OrderedPoints, Spare};
use rayon::prelude::*;
use std::ops::Range;

/// Numbers that are worked on side by side.
pub(crate) const LANES: usize = 16;
/// Rows of cells that one thread takes at a time.
const ROWS_AT_A_TIME: usize = 8;

/// One coordinate of some points; what is left of the last lanes is infinitely far.
pub(crate) type Column<'a> = &'a [[f32; LANES]];

/// The points in and around a cell.
#[derive(Default)]
pub(crate) struct Block {
    /// Longer than the block, so that they need not grow.
    columns: [Vec<[f32; LANES]>; 3],
    len: usize,
}

impl Block {
    pub(crate) fn columns(&self) -> [Column<'_>; 3] {
        self.columns.each_ref().map(|column| &column[..self.len.div_ceil(LANES)])
    }

    pub(crate) fn gather(&mut self, points: &OrderedPoints, runs: &[Range<usize>]) {
        self.len = runs.iter().map(ExactSizeIterator::len).sum();
        for (own, column) in self.columns.iter_mut().zip(points.columns()) {
            if own.len() * LANES < self.len + LANES {
                own.resize(self.len.div_ceil(LANES) + 1, [0.0; LANES]);
            }
            let own = own.as_flattened_mut();
            let mut end = 0;
            for run in runs.iter().filter(|run| !run.is_empty()) {
                copy_run(column, run.clone(), &mut own[end..]);
                end += run.len();
            }
            own[end..end.next_multiple_of(LANES)].fill(f32::INFINITY);
        }
    }
}

/// Copies a run; a short one as whole lanes, which is faster than a call. What is written beyond its end means nothing.
#[inline]
fn copy_run(column: &[f32], run: Range<usize>, to: &mut [f32]) {
    match (column[run.start..].first_chunk::<LANES>(), to.first_chunk_mut::<LANES>()) {
        (Some(from), Some(to)) if run.len() <= LANES => *to = *from,
        _ => to[..run.len()].copy_from_slice(&column[run]),
    }
}

impl OrderedPoints {
    /// Hands every cell that has points to `work`: the places of its points in the order, and all points of the cells around
    /// it, which hold everything within the side of a cell of each of them. `work` has a place to work in. It makes
    /// something of each point of the cell; what comes of it is in the order of the cells.
    pub(crate) fn each_block<P: Default + Send, T: Copy + Default + Send + Sync>(
        &self,
        work: impl Fn(&mut P, Range<usize>, &Block, &mut [T]) + Sync,
    ) -> Vec<T> {
        let cells = self.cells();
        let mut made = vec![T::default(); cells.order().len()];
        let mut left = &mut made[..];
        let mut rows: Vec<(usize, &mut [T])> = cells
            .occupied_rows()
            .map(|row| (row, left.split_off_mut(..cells.places_in_row(row).len()).expect("rows share the places")))
            .collect();
        let spare = Spare::<(Block, P)>::default();
        rows.par_chunks_mut(ROWS_AT_A_TIME).for_each(|rows| {
            spare.with(|(block, workplace)| {
                for (row, made) in rows {
                    let first = cells.places_in_row(*row).start;
                    cells.row_blocks(*row, |members, runs| {
                        block.gather(self, runs);
                        work(workplace, members.clone(), block, &mut made[members.start - first..members.end - first]);
                    });
                }
            });
        });
        made
    }

    /// Of things in the order of the cells, one a point, those of the points in their own order.
    pub(crate) fn in_order_of_points<T: Copy + Default>(&self, of_places: &[T]) -> Vec<T> {
        let mut of_points = vec![T::default(); of_places.len()];
        self.cells().order().iter().zip(of_places).for_each(|(&i, made)| of_points[i as usize] = *made);
        of_points
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use crate::random::Stream;

    #[test]
    fn every_point_is_a_member_once_and_all_that_is_near_is_beside_it() {
        let mut stream = Stream::new(3, 0);
        let points: Vec<Point> = (0..600).map(|_| std::array::from_fn(|_| stream.between(-9.0, 9.0) as f32)).collect();
        for side in [0.4, 2.0, 50.0] {
            let ordered = OrderedPoints::new(&points, side);
            let near = |place: usize, [x, y, z]: [f32; 3]| {
                let p = ordered.point(place);
                f64::from((p[0] - x).powi(2) + (p[1] - y).powi(2) + (p[2] - z).powi(2)).sqrt() <= 0.999 * side
            };
            let counted = ordered.each_block(|(): &mut (), members, block, out| {
                let [x, y, z] = block.columns().map(|column| column.as_flattened());
                let beside = || (0..x.len()).map(|i| [x[i], y[i], z[i]]);
                assert_eq!(beside().filter(|p| p[0].is_finite()).count(), block.len);
                assert_eq!(members.len(), out.len());
                for (out, place) in out.iter_mut().zip(members) {
                    *out = (place, beside().filter(|p| near(place, *p)).count());
                }
            });
            assert!(counted.iter().map(|(place, _)| *place).eq(0..600), "{side}");
            for (place, count) in counted {
                let all = points.iter().filter(|p| near(place, **p)).count();
                assert_eq!(count, all, "{side}");
            }
        }
        assert!(OrderedPoints::new(&[], 1.0).each_block(|(): &mut (), _, _, out: &mut [u8]| out.fill(1)).is_empty());
    }
}
