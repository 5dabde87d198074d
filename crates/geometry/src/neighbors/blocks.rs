//! The points of a cell together with all points around it, gathered once for the whole cell.
//!
//! If every point of a cloud is queried in the same way, the points of one cell all examine the same points. These are
//! laid out in rows of whole vector registers, so that they can be processed without branches.

use crate::{OrderedPoints, Point, Spare};
use rayon::prelude::*;
use std::ops::Range;

/// Number of values processed side by side.
pub(crate) const LANES: usize = 16;
/// Number of rows of cells that one thread takes at a time.
const ROWS_AT_A_TIME: usize = 8;

/// One coordinate of some points; unused lanes at the end are infinite.
pub(crate) type Column<'a> = &'a [[f32; LANES]];

/// The points in and around a cell.
#[derive(Default)]
pub(crate) struct Block {
    /// May be longer than the block, so that they need not grow.
    columns: [Vec<[f32; LANES]>; 3],
    len: usize,
    /// Positions within the block of the points of the cell.
    members: Range<usize>,
}

impl Block {
    pub(crate) fn columns(&self) -> [Column<'_>; 3] {
        self.columns.each_ref().map(|column| &column[..self.len.div_ceil(LANES)])
    }

    /// Applies `of_one` to each point of the cell and to the block without it, in which that point is infinitely far
    /// away.
    #[inline(always)]
    pub(crate) fn each_without_itself<T>(&mut self, made: &mut [T], of_one: impl Fn(Point, [Column<'_>; 3]) -> T) {
        for (made, i) in made.iter_mut().zip(self.members.clone()) {
            let own = self.columns.each_ref().map(|column| column.as_flattened()[i]);
            self.columns[0].as_flattened_mut()[i] = f32::INFINITY;
            *made = of_one(own, self.columns());
            self.columns[0].as_flattened_mut()[i] = own[0];
        }
    }

    /// Gathers the points of the runs, which include those of the cell.
    fn gather_around(&mut self, points: &OrderedPoints, members: Range<usize>, runs: &[Range<usize>]) {
        self.gather(points, runs);
        let before = |run: &Range<usize>| members.start.clamp(run.start, run.end) - run.start;
        let first = runs.iter().map(before).sum();
        self.members = first..first + members.len();
    }

    pub(crate) fn gather(&mut self, points: &OrderedPoints, runs: &[Range<usize>]) {
        self.len = runs.iter().map(ExactSizeIterator::len).sum();
        let rows = self.len.div_ceil(LANES) + 1;
        if self.columns[0].len() < rows {
            self.columns.iter_mut().for_each(|own| own.resize(rows, [0.0; LANES]));
        }
        let mut own = self.columns.each_mut().map(|own| own.as_flattened_mut());
        let mut end = 0;
        for run in runs.iter().filter(|run| !run.is_empty()) {
            own.iter_mut().zip(points.columns()).for_each(|(own, column)| copy_run(column, run, &mut own[end..]));
            end += run.len();
        }
        own.iter_mut().for_each(|own| own[end..end.next_multiple_of(LANES)].fill(f32::INFINITY));
    }
}

/// Copies a run as whole lanes, which is faster than a call. Values written beyond its end are meaningless.
#[inline]
fn copy_run(column: &[f32], run: &Range<usize>, to: &mut [f32]) {
    let whole = run.len().next_multiple_of(LANES);
    match (column.get(run.start..run.start + whole), to.get_mut(..whole)) {
        (Some(from), Some(to)) => {
            let (to, from) = (to.as_chunks_mut::<LANES>().0, from.as_chunks::<LANES>().0);
            to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        _ => to[..run.len()].copy_from_slice(&column[run.clone()]),
    }
}

impl OrderedPoints {
    /// Passes every occupied cell to `work`: the places of its points in the order, and all points of the surrounding
    /// cells, which contain everything within one cell side of each of them. `work` is lent a workspace and computes
    /// one value for each point of the cell; the values are returned in cell order.
    pub(crate) fn each_block<P: Default + Send, T: Copy + Default + Send + Sync>(
        &self,
        work: impl Fn(&mut P, Range<usize>, &mut Block, &mut [T]) + Sync,
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
                        block.gather_around(self, members.clone(), runs);
                        work(workplace, members.clone(), block, &mut made[members.start - first..members.end - first]);
                    });
                }
            });
        });
        made
    }

    /// Reorders values in cell order, one per point, into the original order of the points.
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
