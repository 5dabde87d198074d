//! One of the points in each cell of a grid, unchanged.

use rayon::prelude::*;

/// Returns, for each occupied cubic cell `floor(x / leaf)`, the position of the point nearest to the cell's centre; ties
/// go to the first. The positions are ascending.
///
/// # Panics
/// With 2³² points or more.
pub fn most_central(points: impl IndexedParallelIterator<Item = [f64; 3]>, leaf: f64) -> Vec<u32> {
    let n = u32::try_from(points.len()).expect("a cloud has fewer than 2^32 points");
    let place = |(point, i): ([f64; 3], u32)| {
        let at = point.map(|v| v / leaf);
        let from_centre_sq: f64 = at.iter().map(|v| (v - v.floor() - 0.5).powi(2)).sum();
        (at.map(|v| v.floor() as i64), from_centre_sq, i)
    };
    let mut places: Vec<([i64; 3], f64, u32)> = points.zip(0..n).map(place).collect();
    places.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    places.dedup_by_key(|place| place.0);
    let mut kept: Vec<u32> = places.iter().map(|place| place.2).collect();
    kept.par_sort_unstable();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn each_occupied_cell_keeps_its_most_central_point() {
        let mut stream = Stream::new(3, 0);
        let points: Vec<[f64; 3]> = (0..500).map(|_| [0.0; 3].map(|_: f64| stream.between(-5.0, 5.0))).collect();
        let kept = most_central(points.par_iter().copied(), 2.0);
        let cell = |p: &[f64; 3]| p.map(|v| (v / 2.0).floor() as i64);
        let from_centre = |p: &[f64; 3]| p.iter().map(|v| (v.rem_euclid(2.0) - 1.0).powi(2)).sum::<f64>();
        let mut expected: Vec<u32> = (0..500u32)
            .filter(|&i| {
                let own = &points[i as usize];
                points.iter().filter(|p| cell(p) == cell(own)).all(|p| from_centre(p) >= from_centre(own))
            })
            .collect();
        expected.sort_unstable();
        assert_eq!(kept, expected);
    }

    #[test]
    fn ties_go_to_the_first() {
        let points = [[0.75, 0.5, 0.5], [0.25, 0.5, 0.5], [0.25, 0.5, 0.5], [-9.0, 0.0, 0.0]];
        assert_eq!(most_central(points.par_iter().copied(), 1.0), [0, 3]);
        assert!(most_central(points[..0].par_iter().copied(), 1.0).is_empty());
    }
}
