//! The nearest points of queries that move little from one time to the next.

use super::ordered::{distance_sq, lesser};
use crate::{OrderedPoints, Point};

/// A query that has found nothing searches farther by this factor, …
const WIDER: f64 = 1.3;
/// … if it has moved by less than this fraction of the radius, since it will then hardly move farther.
const SETTLED: f64 = 0.05;
/// Fraction of a distance by which rounding may change it, with an ample margin.
const ROUNDING: f32 = 1e-5;
const NOBODY: u32 = u32::MAX;

/// Where a query was at its last search, and what that search implies for nearby queries.
#[derive(Clone, Copy, Debug)]
pub struct LastSeen {
    at: Point,
    nearest: u32,
    /// With a nearest point: how far the query may move before another can be nearer. Without: how far away there is no
    /// point.
    free: f32,
}

impl Default for LastSeen {
    /// Returns the state before any search.
    fn default() -> Self {
        LastSeen { at: [f32::NAN; 3], nearest: NOBODY, free: 0.0 }
    }
}

impl OrderedPoints {
    /// Returns the nearest point at most `radius` away (data units), by its position in the slice that was sorted; ties
    /// go to the first in order.
    ///
    /// No search takes place if the query has moved so little since the last one that, by the triangle inequality, its
    /// nearest point must be the same or still out of reach.
    pub fn nearest_following(&self, query: &Point, radius: f64, last: &mut LastSeen) -> Option<u32> {
        let moved = distance_sq(&last.at, query).sqrt();
        if last.nearest == NOBODY && moved + radius as f32 <= last.free {
            return None;
        }
        // NaN leads to a search.
        let is_known = last.nearest != NOBODY && moved <= last.free;
        if !is_known {
            *last = self.seen(query, radius, f64::from(moved) < SETTLED * radius);
        }
        let nearest = (last.nearest != NOBODY).then_some(last.nearest as usize)?;
        let is_near = distance_sq(&self.point(nearest), query) <= radius as f32 * radius as f32;
        is_near.then(|| self.cells().order()[nearest])
    }

    fn seen(&self, query: &Point, radius: f64, is_settled: bool) -> LastSeen {
        let farthest = if is_settled { WIDER * radius } else { radius };
        let mut reach = self.side().min(radius);
        loop {
            let (first, second_sq) = self.two_nearest(query, reach);
            if let Some((nearest, away)) = first {
                let second = second_sq.sqrt().min(reach as f32);
                let free = 0.5 * (second - away.sqrt()) - ROUNDING * second;
                return LastSeen { at: *query, nearest: nearest as u32, free };
            }
            if reach >= farthest {
                return LastSeen { at: *query, nearest: NOBODY, free: (1.0 - ROUNDING) * reach as f32 };
            }
            reach = if reach < radius { (2.0 * reach).min(radius) } else { farthest };
        }
    }

    /// Returns the nearest point at most `reach` away and its squared distance, ties going to the first in order; and
    /// the squared distance of the next point. If that exceeds `reach`, it means only that no other point is within
    /// `reach`.
    pub(crate) fn two_nearest(&self, query: &Point, reach: f64) -> (Option<(usize, f32)>, f32) {
        let (mut nearest, mut first, mut second) = (0, f32::INFINITY, f32::INFINITY);
        self.cells().around(query, reach, |run| {
            let columns = self.columns().each_ref().map(|column| &column[run.clone()]);
            for (i, place) in run.enumerate() {
                let away = distance_sq(&columns.map(|column| column[i]), query);
                // Without a branch: whether a point is nearer than those before is almost random.
                let is_first = away < first;
                second = lesser(second, if is_first { first } else { away });
                nearest = if is_first { place } else { nearest };
                first = lesser(first, away);
            }
        });
        ((first <= reach as f32 * reach as f32).then_some((nearest, first)), second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// Queries that wander in ever smaller steps find what an independent search finds.
    #[test]
    fn what_is_remembered_is_what_a_search_finds() {
        let mut stream = Stream::new(5, 0);
        let mut point = |half: f64| -> Point { std::array::from_fn(|_| stream.between(-half, half) as f32) };
        let mut points: Vec<Point> = (0..800).map(|_| point(10.0)).collect();
        points.extend_from_within(..80);
        let ordered = OrderedPoints::new(&points, 0.8);
        let mut spared = 0;
        for _ in 0..400 {
            let (mut query, mut last) = (point(13.0), LastSeen::default());
            for round in 0..30 {
                let radius = [3.0, 2.0, 1.0][round / 10];
                let before = last.at;
                let found = ordered.nearest_following(&query, radius, &mut last);
                assert_eq!(found, ordered.nearest_following(&query, radius, &mut LastSeen::default()));
                spared += usize::from(last.at == before && before != query);
                let step = point(0.5 / f64::from(1 << (round / 2)));
                query = std::array::from_fn(|axis| query[axis] + step[axis]);
            }
        }
        assert!(spared > 6000, "{spared}");
    }

    #[test]
    fn a_place_between_two_points_is_always_looked_at() {
        let ordered = OrderedPoints::new(&[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 4.0);
        let mut last = LastSeen::default();
        let mut nearest = |x: f32| ordered.nearest_following(&[x, 0.0, 0.0], 9.0, &mut last).unwrap();
        assert_eq!([0.0, 1e-7, -1e-7, 0.5, 0.1, -0.1].map(&mut nearest), [0, 1, 0, 1, 1, 0]);
    }

    #[test]
    fn what_is_no_place_finds_nothing() {
        let ordered = OrderedPoints::new(&[[0.0; 3]], 1.0);
        let mut last = LastSeen::default();
        for query in [[f32::NAN; 3], [f32::INFINITY; 3], [1e30; 3]] {
            assert_eq!(ordered.nearest_following(&query, 2.0, &mut last), None);
        }
        assert_eq!(ordered.nearest_following(&[1.0, 0.0, 0.0], 2.0, &mut last), Some(0));
        assert_eq!(OrderedPoints::new(&[], 1.0).nearest_following(&[0.0; 3], 2.0, &mut last), None);
    }
}
