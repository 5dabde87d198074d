//! The reach of a scan: coordinates beyond it stand for "nothing was measured".

/// Number of points that are sampled.
const SAMPLED: usize = 1000;
/// Fraction of the points set aside at each end of each axis; the width is measured between them.
const ENDS: f64 = 0.05;
/// Minimum number of distinct places among the sampled points; with fewer it is unknown where the scan is.
const FEWEST_PLACES: usize = 20;
/// Number of widths beyond that range at which a scan ends. Scans of streets and fields with a scanner in their midst
/// reach some five; a coordinate of −9999 next to an object measured in millimetres, fifty or more.
const WIDTHS: f64 = 50.0;

/// A box far larger than the scan.
pub(crate) struct Reach {
    low: [f64; 3],
    high: [f64; 3],
}

impl Reach {
    /// Returns the reach of `n` finite points; infinite where nearly all of them coincide. However many points are at
    /// one place, it counts once: a scan may have the coordinates of "nothing was measured" in a third of its pixels.
    pub(crate) fn of(points: impl Iterator<Item = [f64; 3]>, n: usize) -> Reach {
        let mut sample: Vec<[f64; 3]> = points.step_by(n.div_ceil(SAMPLED).max(1)).collect();
        sample.sort_unstable_by(|a, b| {
            let by_axis = |axis: usize| a[axis].total_cmp(&b[axis]);
            by_axis(0).then_with(|| by_axis(1)).then_with(|| by_axis(2))
        });
        sample.dedup();
        let ends: [Option<(f64, f64)>; 3] = std::array::from_fn(|axis| inner(sample.iter().map(|p| p[axis]).collect()));
        let width = ends.iter().flatten().map(|(low, high)| high - low).fold(0.0, f64::max);
        let is_known = sample.len() >= FEWEST_PLACES && width > 0.0;
        let margin = if is_known { WIDTHS * width } else { f64::INFINITY };
        Reach {
            low: ends.map(|ends| ends.map_or(f64::NEG_INFINITY, |(low, _)| low - margin)),
            high: ends.map(|ends| ends.map_or(f64::INFINITY, |(_, high)| high + margin)),
        }
    }

    /// Returns whether a point can belong to the scan.
    pub(crate) fn holds(&self, p: &[f64; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= p[axis] && p[axis] <= self.high[axis])
    }
}

/// Returns the range that remains between the two ends; all of it if there are few values.
pub(crate) fn inner(mut values: Vec<f64>) -> Option<(f64, f64)> {
    let last = values.len().checked_sub(1)?;
    let aside = (last as f64 * ENDS) as usize;
    let mut at = |place: usize| *values.select_nth_unstable_by(place, f64::total_cmp).1;
    Some((at(aside), at(last - aside)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    fn reach(points: &[[f64; 3]]) -> Reach {
        Reach::of(points.iter().copied(), points.len())
    }

    #[test]
    fn what_no_scan_reaches_is_beyond_it() {
        let mut stream = Stream::new(1, 0);
        let mut points: Vec<[f64; 3]> = (0..5000).map(|_| std::array::from_fn(|_| stream.between(-0.1, 0.1))).collect();
        points[77] = [-9999.0; 3];
        points[78] = [0.0, 0.0, 1.0];
        let reach = reach(&points);
        let beyond: Vec<usize> = (0..points.len()).filter(|&i| !reach.holds(&points[i])).collect();
        assert_eq!(beyond, [77]);
    }

    #[test]
    fn a_place_that_many_points_share_counts_once() {
        let mut stream = Stream::new(2, 0);
        let scan: Vec<[f64; 3]> = (0..7000).map(|_| std::array::from_fn(|_| stream.between(-0.1, 0.1))).collect();
        for n_unmeasured in [400, 3000, 100_000] {
            let unmeasured = vec![[-9999.0; 3]; n_unmeasured];
            for points in [[scan.clone(), unmeasured.clone()].concat(), [unmeasured, scan.clone()].concat()] {
                let reach = reach(&points);
                assert!(scan.iter().all(|p| reach.holds(p)) && !reach.holds(&[-9999.0; 3]), "{n_unmeasured}");
            }
        }
    }

    #[test]
    fn few_points_and_points_at_one_place_have_no_end() {
        for points in [vec![], vec![[1.0; 3]], vec![[0.0; 3], [1.0; 3], [1e9, 0.0, 0.0]]] {
            assert!(points.iter().all(|p| reach(&points).holds(p)));
        }
        let mut heap = vec![[2.0; 3]; 1000];
        heap[3] = [7.0; 3];
        assert!(reach(&heap).holds(&[1e6; 3]));
    }
}
