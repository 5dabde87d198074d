//! A cloud sorted by grid cell, one coordinate at a time: points that are close together are close in memory.

use crate::{Cells, Neighbor, Point};

/// Points are crowded if the cell of a point holds more than this many points on average.
const MAX_CROWDING: f64 = 40.0;
/// A radius that held too few points grows by this factor …
const GROWTH: f64 = 1.5;
/// … up to this multiple of the initial radius; then all points are searched.
const MAX_GROWN: f64 = 100.0;

/// Number of near points that are buffered before they are visited.
const NOTED: usize = 128;

/// Points sorted by grid cell. A place is a position in that order; [`Cells::order`] tells which point it holds.
pub struct OrderedPoints {
    cells: Cells,
    columns: [Vec<f32>; 3],
    /// Side of the cells as requested, data units.
    side: f64,
}

impl OrderedPoints {
    /// Sorts points into cells of about this side (data units). Searches are fastest if a cell holds a few points.
    ///
    /// # Panics
    /// As for [`Cells::new`].
    #[must_use]
    pub fn new(points: &[Point], side: f64) -> Self {
        let cells = Cells::new(points, side);
        let column = |axis: usize| cells.order().iter().map(|&i| points[i as usize][axis]).collect();
        let (x, (y, z)) = rayon::join(|| column(0), || rayon::join(|| column(1), || column(2)));
        OrderedPoints { columns: [x, y, z], cells, side }
    }

    /// Sorts points as `new` does, or returns `None` if they are so crowded that a tree finds neighbours faster, or if
    /// `side` is not above zero.
    #[must_use]
    pub fn unless_crowded(points: &[Point], side: f64) -> Option<Self> {
        let ordered = (side > 0.0).then(|| OrderedPoints::new(points, side));
        ordered.filter(|ordered| ordered.cells.crowding() <= MAX_CROWDING)
    }

    /// Returns the cells, which tell which point is at which place and which places are near a position in space.
    #[inline]
    #[must_use]
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Returns all x, all y and all z coordinates, in order.
    #[inline]
    #[must_use]
    pub fn columns(&self) -> &[Vec<f32>; 3] {
        &self.columns
    }

    /// Returns the point at a place in the order.
    #[inline]
    #[must_use]
    pub fn point(&self, place: usize) -> Point {
        self.columns.each_ref().map(|column| column[place])
    }

    /// Returns the side of the cells as requested, data units.
    pub(crate) fn side(&self) -> f64 {
        self.side
    }

    /// Visits every point at most `radius` away (inclusive), by its place in the order, ascending, with its squared
    /// distance.
    #[inline]
    pub fn within(&self, query: &Point, radius: f64, mut visit: impl FnMut(usize, f32)) {
        let limit = radius as f32 * radius as f32;
        // Every point is written to the buffer and kept only if near: a branch would be unpredictable.
        let (mut near, mut n) = ([(0, 0.0); NOTED], 0);
        self.cells.around(query, radius, |run| {
            let columns = self.columns.each_ref().map(|column| &column[run.clone()]);
            for (i, place) in run.enumerate() {
                let away = distance_sq(&columns.map(|column| column[i]), query);
                near[n] = (place as u32, away);
                n += usize::from(away <= limit);
                if n == NOTED {
                    near.iter().for_each(|&(place, away)| visit(place as usize, away));
                    n = 0;
                }
            }
        });
        near[..n].iter().for_each(|&(place, away)| visit(place as usize, away));
    }

    /// Finds the places of the `k` nearest points, in no particular order, or of all points if there are fewer; ties go
    /// to the first in the order. `guess` is a radius (data units) that holds about that many; `found` is overwritten.
    pub fn nearest_n(&self, query: &Point, k: usize, guess: f64, found: &mut Vec<u64>) {
        let k = k.min(self.cells.order().len());
        for reach in growing(if guess > 0.0 { guess } else { self.side }) {
            self.keys_within(query, reach, found);
            if found.len() >= k {
                break;
            }
        }
        if found.len() > k && k > 0 {
            found.select_nth_unstable(k - 1);
        }
        found.truncate(k);
        found.iter_mut().for_each(|found| *found &= u64::from(u32::MAX));
    }

    /// Collects the squared distance and the place of every point at most `radius` away, as numbers that sort by
    /// distance, then by place: a squared distance is not negative, so its bits sort like its value.
    fn keys_within(&self, query: &Point, radius: f64, keys: &mut Vec<u64>) {
        let limit = radius as f32 * radius as f32;
        let mut n = 0;
        self.cells.around(query, radius, |run| {
            if keys.len() < n + run.len() {
                keys.resize(n + run.len(), 0);
            }
            let columns = self.columns.each_ref().map(|column| &column[run.clone()]);
            for (i, place) in run.enumerate() {
                let away = distance_sq(&columns.map(|column| column[i]), query);
                // As in `within`.
                keys[n] = u64::from(away.to_bits()) << 32 | place as u64;
                n += usize::from(away <= limit);
            }
        });
        keys.truncate(n);
    }

    /// Returns the squared distance from one of the points to the nearest other one, which is searched within `radius`
    /// (data units) first; infinite if there is no other point.
    pub(crate) fn nearest_other_sq(&self, point: &Point, radius: f64) -> f32 {
        // The point itself is the nearest.
        let found = growing(radius).find_map(|reach| {
            let (_, second) = self.two_nearest(point, reach);
            (second.is_finite() && f64::from(second) <= reach * reach).then_some(second)
        });
        found.unwrap_or(f32::INFINITY)
    }

    /// Returns the nearest other point of the one at position `i` of the slice, which is at `point`; `None` if there is no
    /// other. It is searched within `radius` (data units) first; `keys` is overwritten.
    pub(crate) fn nearest_other(&self, i: u32, point: &Point, radius: f64, keys: &mut Vec<u64>) -> Option<Neighbor> {
        let of = |key: &u64| (key >> 32, self.cells.order()[(key & u64::from(u32::MAX)) as usize]);
        let (bits, index) = growing(radius).find_map(|reach| {
            self.keys_within(point, reach, keys);
            keys.iter().map(of).filter(|(_, index)| *index != i).min()
        })?;
        Some(Neighbor { index, distance_sq: f32::from_bits(bits as u32) })
    }

    /// Returns whether at least `count` points lie within `radius` (inclusive).
    #[must_use]
    pub fn has_within(&self, query: &Point, radius: f64, count: usize) -> bool {
        let limit = radius as f32 * radius as f32;
        let near = self.cells.runs(query, radius).flatten();
        near.filter(|&place| distance_sq(&self.point(place), query) <= limit).take(count).count() == count
    }
}

/// Returns the radii to search in turn until enough is found; the last one is infinite.
fn growing(first: f64) -> impl Iterator<Item = f64> {
    let wider = move |radius: &f64| if *radius < MAX_GROWN * first { GROWTH * radius } else { f64::INFINITY };
    std::iter::successors(Some(first), move |radius| radius.is_finite().then(|| wider(radius)))
}

/// Returns the lesser of two numbers, neither of which is NaN; a single instruction.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
pub(crate) fn distance_sq(a: &Point, b: &Point) -> f32 {
    let offset: Point = std::array::from_fn(|axis| a[axis] - b[axis]);
    offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LastSeen;
    use crate::random::Stream;

    fn nearest(ordered: &OrderedPoints, query: &Point, radius: f64) -> Option<u32> {
        ordered.nearest_following(query, radius, &mut LastSeen::default())
    }

    #[test]
    fn the_nearest_in_reach_is_found() {
        let mut stream = Stream::new(8, 0);
        let mut point = |half: f64| -> Point { std::array::from_fn(|_| stream.between(-half, half) as f32) };
        let mut points: Vec<Point> = (0..500).map(|_| point(10.0)).collect();
        points.extend_from_within(..50);
        for (side, radius) in [(0.5, 3.0), (2.0, 2.0), (5.0, 1.0), (1e-7, 2.0), (1e9, 1e3)] {
            let ordered = OrderedPoints::new(&points, side);
            for _ in 0..300 {
                let query = point(13.0);
                let nearest = points.iter().map(|p| distance_sq(p, &query)).fold(f32::INFINITY, f32::min);
                let away = self::nearest(&ordered, &query, radius).map(|i| distance_sq(&points[i as usize], &query));
                assert_eq!(away, Some(nearest).filter(|d| *d <= (radius * radius) as f32));
            }
        }
    }

    #[test]
    fn all_that_are_near_are_found() {
        let mut stream = Stream::new(9, 0);
        let mut point = |half: f64| -> Point { std::array::from_fn(|_| stream.between(-half, half) as f32) };
        let mut points: Vec<Point> = (0..400).map(|_| point(10.0)).collect();
        points.extend_from_within(..40);
        let mut found = Vec::new();
        for (side, radius) in [(0.5, 3.0), (4.0, 1.0), (1e-7, 2.0)] {
            let ordered = OrderedPoints::new(&points, side);
            for k in [0, 1, 12, 30, 1000] {
                let query = point(13.0);
                let mut all: Vec<f32> = points.iter().map(|p| distance_sq(p, &query)).collect();
                all.sort_by(f32::total_cmp);
                let mut within = 0;
                ordered.within(&query, radius, |place, away| {
                    assert_eq!(distance_sq(&ordered.point(place), &query), away);
                    within += 1;
                });
                assert_eq!(within, all.iter().filter(|d| **d <= (radius * radius) as f32).count());
                ordered.nearest_n(&query, k, radius, &mut found);
                let mut nearest: Vec<f32> =
                    found.iter().map(|&place| distance_sq(&ordered.point(place as usize), &query)).collect();
                nearest.sort_by(f32::total_cmp);
                assert_eq!(nearest, all[..k.min(all.len())]);
            }
        }
        OrderedPoints::new(&[], 1.0).nearest_n(&[0.0; 3], 3, 1.0, &mut found);
        assert!(found.is_empty());
    }

    #[test]
    fn a_point_on_the_rim_is_within() {
        let ordered = OrderedPoints::new(&[[0.0; 3], [9.0, 0.0, 0.0]], 1.0);
        assert_eq!(nearest(&ordered, &[0.0, 3.0, 0.0], 3.0), Some(0));
        assert_eq!(nearest(&ordered, &[0.0, 3.1, 0.0], 3.0), None);
        assert_eq!(nearest(&ordered, &[f32::NAN; 3], 3.0), None);
        assert_eq!(nearest(&OrderedPoints::new(&[], 1.0), &[0.0; 3], 3.0), None);
    }

    #[test]
    fn crowding_tells_even_clouds_from_clumps() {
        let even: Vec<Point> = (0..400).map(|i| [(i % 20) as f32, (i / 20) as f32, 0.0]).collect();
        let mut clump = even.clone();
        clump.extend((0..400).map(|i| [1e-4 * i as f32, 0.0, 0.0]));
        assert!(OrderedPoints::new(&even, 1.0).cells().crowding() < 2.0);
        assert!(OrderedPoints::new(&clump, 1.0).cells().crowding() > 100.0);
        assert!(
            OrderedPoints::unless_crowded(&even, 1.0).is_some() && OrderedPoints::unless_crowded(&even, 0.0).is_none()
        );
        assert!(OrderedPoints::unless_crowded(&clump, 1.0).is_none());
        assert!(OrderedPoints::unless_crowded(&[], 1.0).is_some());
    }
}
