//! The nearest points of places that move little from one time to the next.

use super::ordered::{distance_sq, lesser};
use crate::{OrderedPoints, Point};

/// A place that has found nothing looks farther by this factor, …
const WIDER: f64 = 1.3;
/// … if it has moved by less than this share of the radius: then it will hardly move farther.
const SETTLED: f64 = 0.05;
/// Share of a distance by which rounding may change it, and far more.
const ROUNDING: f32 = 1e-5;
const NOBODY: u32 = u32::MAX;

/// Where a place was when it was last looked around it, and what that says of the places close by.
#[derive(Clone, Copy, Debug)]
pub struct LastSeen {
    at: Point,
    nearest: u32,
    /// With a nearest point: how far it may move until another can be nearer. With none: how far nobody is.
    free: f32,
}

impl Default for LastSeen {
    /// Nothing has been seen.
    fn default() -> Self {
        LastSeen { at: [f32::NAN; 3], nearest: NOBODY, free: 0.0 }
    }
}

impl OrderedPoints {
    /// The nearest point at most `radius` away (data units), by its position in the slice that was sorted; of equally near ones the
    /// first in order. There is no search where the place has moved so little since the last one that its nearest point must be
    /// the same, or still out of reach: by the triangle inequality.
    pub fn nearest_following(&self, query: &Point, radius: f64, last: &mut LastSeen) -> Option<u32> {
        let moved = distance_sq(&last.at, query).sqrt();
        if last.nearest == NOBODY && moved + radius as f32 <= last.free {
            return None;
        }
        // What is no number is looked for.
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

    /// The nearest point at most `reach` away and its squared distance, of equally near ones the first in order; and a squared
    /// distance within which there is no other, or `reach` at least.
    pub(crate) fn two_nearest(&self, query: &Point, reach: f64) -> (Option<(usize, f32)>, f32) {
        let (mut nearest, mut first, mut second) = (0, f32::INFINITY, f32::INFINITY);
        self.cells().around(query, reach, |run| {
            let columns = self.columns().each_ref().map(|column| &column[run.clone()]);
            for (i, place) in run.enumerate() {
                let away = distance_sq(&columns.map(|column| column[i]), query);
                // Without a branch: which points are nearer than those before is nearly chance.
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

    /// Places that wander in ever smaller steps find what a search of its own finds.
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
