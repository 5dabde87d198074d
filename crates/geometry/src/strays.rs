//! Strays: isolated points from dust, reflections, and what a scanner sees along an edge; and all that is far from the
//! scan.

use crate::distant::belonging;
use crate::{OrderedPoints, Resolution, Scan};
use rayon::prelude::*;

/// Within this many spacings of a point of a surface …
const RADIUS: f64 = 5.0;
/// … there are at least this many other points: about a tenth of the some seventy there are at the usual density.
const FEWEST: usize = 8;
/// If fewer points than this fraction are lonely, they are kept. Scans of objects without strays have at most 0.002.
const FEW: f64 = 0.01;
/// If more points than this fraction have sparse surroundings, it is unknown what they stray from.
const MANY: f64 = 0.5;
/// Minimum fraction of the points with sparse surroundings that are lonely if they are strays; on sparsely sampled
/// surfaces it is about a third to a half.
const LONELY: f64 = 0.7;

/// Returns the scan without its strays; `None` if there are hardly any isolated ones and no distant ones, or if they are
/// too much of it.
///
/// An isolated stray has fewer than eight other points within five spacings, the spacing being the median distance between
/// nearest neighbours, which strays hardly change. In a scan whose density falls off with distance, many points are
/// like that, too; but strays are also lonely: the nearest other point of most of them is more than three spacings
/// away. A distant stray is farther from the scan than the scan is wide, alone or with others; a single one would make
/// the box around the scan, in which grids are laid, a hundred times as large. `measured` is the resolution of the scan.
#[must_use]
pub fn without_strays(scan: &Scan, measured: &Resolution) -> Option<Scan> {
    let connected = without_isolated(scan, measured);
    let left = connected.as_ref().unwrap_or(scan);
    belonging(left.points()).map(|kept| left.only(&kept)).or(connected)
}

fn without_isolated(scan: &Scan, measured: &Resolution) -> Option<Scan> {
    if measured.lonely < FEW {
        return None;
    }
    let radius = RADIUS * measured.median;
    let ordered = OrderedPoints::new(scan.points(), radius / 2.0);
    // The point itself is one of them.
    let kept: Vec<bool> = scan.points().par_iter().map(|p| ordered.has_within(p, radius, FEWEST + 1)).collect();
    let thin = kept.iter().filter(|kept| !**kept).count() as f64 / kept.len() as f64;
    (thin <= MANY && measured.lonely >= LONELY * thin).then(|| scan.only(&kept))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::{Point, RawScan, resolution_sampled};

    fn cleaned(scan: &Scan) -> Option<Scan> {
        without_strays(scan, &resolution_sampled(scan.points(), 4000).unwrap())
    }

    /// A bowl of 10 000 points, and `n_strays` random points in a cube around it.
    fn bowl_and_dust(n_strays: usize) -> Scan {
        let mut stream = Stream::new(5, 0);
        let bowl = (0..10_000).map(|i| {
            let (x, y) = (f64::from(i % 100) / 50.0 - 1.0, f64::from(i / 100) / 50.0 - 1.0);
            [x, y, 0.5 * (x * x + y * y)]
        });
        let mut points: Vec<[f64; 3]> = bowl.collect();
        points.extend((0..n_strays).map(|_| std::array::from_fn(|_| stream.between(-1.5, 1.5))));
        let last = points.len() as u32 - 1;
        let triangles = vec![[0, 1, 100], [0, 1, last.min(10_000)]];
        Scan::new(&RawScan { points: points.into(), triangles, ..RawScan::default() }).unwrap()
    }

    #[test]
    fn strays_go_and_the_surface_stays() {
        for n_strays in [500, 3000] {
            let scan = bowl_and_dust(n_strays);
            let cleaned = cleaned(&scan).unwrap();
            let of_bowl = |points: &[Point]| points.iter().filter(|p| scan.points()[..10_000].contains(p)).count();
            // Strays next to the bowl cannot be told apart from it.
            assert_eq!(of_bowl(cleaned.points()), 10_000);
            assert!(cleaned.points().len() < 10_000 + n_strays / 5, "{} are left", cleaned.points().len());
            assert_eq!((cleaned.origin(), cleaned.triangles()), (scan.origin(), &[[0, 1, 100]][..]));
        }
    }

    #[test]
    fn what_is_distant_goes_however_few_are_isolated() {
        for n_strays in [0, 1000] {
            let mut points: Vec<[f64; 3]> = bowl_and_dust(n_strays).points().iter().map(|p| p.map(f64::from)).collect();
            // A patch, whose points are not isolated, and a single point on the other side.
            points.extend((0..200).map(|i| [30.0, 30.0 + f64::from(i % 20) / 50.0, 30.0 + f64::from(i / 20) / 50.0]));
            points.push([-40.0; 3]);
            let cleaned =
                cleaned(&Scan::new(&RawScan { points: points.into(), ..RawScan::default() }).unwrap()).unwrap();
            assert!(cleaned.extent().max() < 4.0);
            assert!((10_000..=10_000 + n_strays / 5).contains(&cleaned.points().len()), "{}", cleaned.points().len());
        }
    }

    #[test]
    fn without_strays_or_without_anything_else_a_scan_stays_as_it_is() {
        assert!(cleaned(&bowl_and_dust(0)).is_none());
        assert!(cleaned(&bowl_and_dust(1)).is_none());
        let all_at_random = |n: usize| {
            let mut stream = Stream::new(6, 0);
            let points: Vec<[f64; 3]> = (0..n).map(|_| std::array::from_fn(|_| stream.between(-1.0, 1.0))).collect();
            Scan::new(&RawScan { points: points.into(), ..RawScan::default() }).unwrap()
        };
        for n in [3, 4, 9, 500, 5000] {
            assert!(cleaned(&all_at_random(n)).is_none_or(|cleaned| 2 * cleaned.points().len() >= n), "{n}");
        }
    }
}
