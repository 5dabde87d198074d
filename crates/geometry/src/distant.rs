//! Points so far from a scan that the space between is wider than the scan: reflections, pieces of the background, a
//! value that stands for "nothing was measured".

use crate::Point;
use crate::bounds::bounds;
use crate::reach::inner;
use rayon::prelude::*;

/// Number of points that are sampled.
const SAMPLED: usize = 1000;
/// Minimum fraction of the points by which a scan extends farther; fewer do not show that there is surface in between.
const PIECE: f64 = 0.001;
/// If more points than this fraction are distant, it is unknown which part is the scan.
const MANY: f64 = 0.1;

/// Returns for each point whether it belongs to the scan; `None` if all do, or if many do not.
///
/// A scan is what its middle grows to: the box without a twentieth of the points at each end of each axis takes in what
/// is nearer to it than it is wide, again and again. Distant is what is farther from that box than it is wide. The
/// objects measured do not reach farther than 0.8 widths beyond their middle, rooms 1.8, a street 4, and all of them are
/// taken in.
pub(crate) fn belonging(points: &[Point]) -> Option<Vec<bool>> {
    let mut scan = Extent::of_middle(points)?;
    let all = Extent::of(points);
    let (mut n_near, enough) = (0, PIECE * points.len() as f64);
    while !(scan.is_near(&all.low) && scan.is_near(&all.high)) {
        let near: Vec<Point> = points.iter().filter(|p| scan.is_near(p)).copied().collect();
        if ((near.len() - n_near) as f64) < enough {
            let n_distant = points.len() - near.len();
            let are_few = n_distant > 0 && n_distant as f64 <= MANY * points.len() as f64;
            return are_few.then(|| points.par_iter().map(|p| scan.is_near(p)).collect());
        }
        (n_near, scan) = (near.len(), Extent::of(&near));
    }
    None
}

/// A box, and its longest side.
struct Extent {
    low: Point,
    high: Point,
    width: f32,
}

impl Extent {
    fn of(points: &[Point]) -> Extent {
        let (low, high) = bounds(points);
        Extent::between(low, high)
    }

    /// Returns the box without the ends of each axis; `None` if it is nothing.
    fn of_middle(points: &[Point]) -> Option<Extent> {
        let sample = || points.iter().step_by(points.len().div_ceil(SAMPLED).max(1));
        let range = |axis: usize| inner(sample().map(|p| f64::from(p[axis])).collect());
        let ranges = [range(0)?, range(1)?, range(2)?];
        let middle = Extent::between(ranges.map(|(low, _)| low as f32), ranges.map(|(_, high)| high as f32));
        (middle.width > 0.0).then_some(middle)
    }

    fn between(low: Point, high: Point) -> Extent {
        Extent { low, high, width: (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max) }
    }

    /// Returns whether a point is no farther from the box, along each axis, than the box is wide.
    fn is_near(&self, p: &Point) -> bool {
        (0..3).all(|axis| self.low[axis] - self.width <= p[axis] && p[axis] <= self.high[axis] + self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// Points at random in a cube of side `side` around `centre`.
    fn cube(centre: Point, side: f64, n: usize) -> Vec<Point> {
        let mut stream = Stream::new(3, n as u64);
        (0..n).map(|_| centre.map(|v| v + stream.between(-side / 2.0, side / 2.0) as f32)).collect()
    }

    #[test]
    fn what_is_farther_away_than_the_scan_is_wide_is_distant() {
        let scan = cube([0.0; 3], 1.0, 5000);
        for away in [3.0, 15.0, 40.0] {
            for (side, n) in [(0.0, 1), (1.5, 10), (0.3, 100)] {
                let points = [cube([away, -away, away], side, n), scan.clone()].concat();
                let belongs = belonging(&points).unwrap();
                assert!(belongs[..n].iter().all(|belongs| !belongs) && belongs[n..].iter().all(|belongs| *belongs));
            }
        }
    }

    #[test]
    fn what_thins_out_belongs_to_the_scan() {
        let mut stream = Stream::new(4, 0);
        // As around a scanner, whose points thin out with distance: half of them within 0.1, the last at 10.
        let street: Vec<Point> = (0..20_000)
            .map(|_| {
                let (away, along) = (0.05 / (stream.unit() + 0.005), stream.between(0.0, std::f64::consts::TAU));
                [(away * along.cos()) as f32, (away * along.sin()) as f32, stream.between(0.0, 0.2) as f32]
            })
            .collect();
        let (middle, all) = (Extent::of_middle(&street).unwrap(), Extent::of(&street));
        assert!(all.width > 10.0 * middle.width);
        assert_eq!(belonging(&street), None);
    }

    #[test]
    fn a_second_part_and_a_few_points_stay() {
        let two = |n: usize| [cube([0.0; 3], 1.0, 5000), cube([9.0; 3], 1.0, n)].concat();
        assert!(belonging(&two(100)).is_some() && belonging(&two(700)).is_none());
        let same = vec![[1.0; 3]; 50];
        for few in [vec![], vec![[1.0; 3]], vec![[0.0; 3], [1.0; 3], [1e9, 0.0, 0.0]], same] {
            assert_eq!(belonging(&few), None);
        }
    }
}
