//! How two points with normals lie to each other (Rusu 2009; role of the points and binning as in PCL).

use congruent_geometry::{Surface, wide};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Bins of each feature.
pub(crate) const BINS: usize = 11;
/// Three features, one block of bins each.
pub(crate) const DIM: usize = 3 * BINS;

/// The features of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairFeatures {
    /// The angle f1 in [−π, π] as a vector: along and aside of zero, of any length.
    turn: [f64; 2],
    /// In [−1, 1].
    f2: f64,
    /// In [−1, 1].
    f3: f64,
}

/// The features of two points `delta` apart. The same if the points change roles. `None` where the points coincide or
/// their line is along the leading normal.
fn pair_features(n1: &Vector3<f64>, n2: &Vector3<f64>, delta: &Vector3<f64>) -> Option<PairFeatures> {
    // The point whose normal is nearer to the line leads.
    let (n1, n2, delta) = if n1.dot(delta).abs() < n2.dot(delta).abs() { (n2, n1, -delta) } else { (n1, n2, *delta) };
    let across = delta.cross(n1);
    let (length, width) = (delta.norm(), across.norm());
    if length <= 0.0 || width <= 0.0 {
        return None;
    }
    let v = across / width;
    let w = n1.cross(&v);
    Some(PairFeatures { turn: [n1.dot(n2), w.dot(n2)], f2: v.dot(n2), f3: n1.dot(&delta) / length })
}

/// The simplified histogram (SPFH) of one point: percentages of its pairs with all neighbours, each block summing to
/// 100. All zero where there is no pair.
pub(crate) fn pair_histogram(surface: &Surface, i: u32, radius: f64) -> [f32; DIM] {
    let mut counts = [0u32; DIM];
    surface.index().within(&surface.points()[i as usize], radius, |n| {
        if let Some(bins) = pair_bins(surface, i, n.index) {
            bins.iter().for_each(|&bin| counts[bin] += 1);
        }
    });
    percentages(&counts)
}

/// The histograms of all points for which `needed` holds, zero for the others.
///
/// A pair falls into the same bins for both of its points, so it is looked at once. The counts are whole numbers, whose
/// sums do not depend on who adds them.
pub(crate) fn pair_histograms(surface: &Surface, needed: &[bool], radius: f64) -> Vec<[f32; DIM]> {
    let n = surface.len();
    let share = n.div_ceil(2 * rayon::current_num_threads()).max(1);
    let parts: Vec<Vec<[u32; DIM]>> = (0..n.div_ceil(share))
        .into_par_iter()
        .map(|part| {
            let mut counts = vec![[0u32; DIM]; n];
            for i in (part * share..n.min((part + 1) * share)).filter(|&i| needed[i]) {
                surface.index().within(&surface.points()[i], radius, |found| {
                    let j = found.index as usize;
                    if needed[j] && !is_first(i, j) {
                        return;
                    }
                    let Some(bins) = pair_bins(surface, i as u32, found.index) else { return };
                    bins.iter().for_each(|&bin| counts[i][bin] += 1);
                    if needed[j] {
                        bins.iter().for_each(|&bin| counts[j][bin] += 1);
                    }
                });
            }
            counts
        })
        .collect();
    let total =
        |i: usize| parts.iter().fold([0u32; DIM], |sum, part| std::array::from_fn(|bin| sum[bin] + part[i][bin]));
    (0..n).into_par_iter().map(|i| percentages(&total(i))).collect()
}

/// Which of two points looks at their pair: each does so with half of its neighbours.
fn is_first(i: usize, j: usize) -> bool {
    (i < j) == (i + j).is_multiple_of(2)
}

fn pair_bins(surface: &Surface, i: u32, j: u32) -> Option<[usize; 3]> {
    // Always in the same order: of two normals equally near to the line the first leads.
    let (i, j) = (i.min(j) as usize, i.max(j) as usize);
    let (n1, n2) = (wide(surface.normals()[i]), wide(surface.normals()[j]));
    if n1 == Vector3::zeros() || n2 == Vector3::zeros() {
        return None;
    }
    let delta = wide(surface.points()[j]) - wide(surface.points()[i]);
    pair_features(&n1, &n2, &delta).map(|features| bins(&features))
}

fn percentages(counts: &[u32; DIM]) -> [f32; DIM] {
    let n_pairs: u32 = counts[..BINS].iter().sum();
    counts.map(|count| (100.0 * f64::from(count) / f64::from(n_pairs.max(1))) as f32)
}

/// Cosines of the borders of the bins of f1, odd multiples of π/11: the middle bin lies around zero.
const ANGLE_BORDERS: [f64; 5] = [
    0.959_492_973_614_497_4,
    0.654_860_733_945_285_1,
    0.142_314_838_273_285_14,
    -0.415_415_013_001_886_4,
    -0.841_253_532_831_181_2,
];

fn bins(features: &PairFeatures) -> [usize; 3] {
    let bin = |cosine: f64| (((cosine + 1.0) / 2.0 * BINS as f64).max(0.0) as usize).min(BINS - 1);
    // The angle's bin by comparing cosines: the angle itself is not needed.
    let [along, aside] = features.turn;
    let length = (along * along + aside * aside).sqrt();
    let steps = ANGLE_BORDERS.iter().filter(|&&border| along <= border * length).count();
    let angle_bin = if aside >= 0.0 { BINS / 2 + steps } else { BINS / 2 - steps };
    [angle_bin, BINS + bin(features.f2), 2 * BINS + bin(features.f3)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    fn direction(stream: &mut Stream) -> Vector3<f64> {
        Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize()
    }

    #[test]
    fn the_roles_of_the_points_do_not_matter() {
        let mut stream = Stream::new(1, 0);
        for _ in 0..1000 {
            let (n1, n2, delta) = (direction(&mut stream), direction(&mut stream), direction(&mut stream));
            assert_eq!(pair_features(&n1, &n2, &delta), pair_features(&n2, &n1, &-delta));
        }
    }

    #[test]
    fn a_known_pair_has_its_features() {
        // n1 leads at 60° to the line; n2 is turned from n1 by 30° about v = −z.
        let (n1, n2) = (angled(60.0), angled(90.0));
        let PairFeatures { turn: [along, aside], f2, f3 } = pair_features(&n1, &n2, &Vector3::x()).unwrap();
        let f1 = aside.atan2(along);
        assert!((f1.abs() - 30f64.to_radians()).abs() < 1e-12 && f2.abs() < 1e-12 && (f3 - 0.5).abs() < 1e-12);
    }

    fn angled(degrees: f64) -> Vector3<f64> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector3::new(cos, sin, 0.0)
    }

    #[test]
    fn pairs_without_a_frame_have_none() {
        assert_eq!(pair_features(&Vector3::x(), &Vector3::y(), &Vector3::zeros()), None);
        assert_eq!(pair_features(&Vector3::x(), &Vector3::y(), &Vector3::x()), None);
    }

    #[test]
    fn the_ends_of_the_ranges_are_in_range() {
        let at = |f1: f64, f2, f3| bins(&PairFeatures { turn: [f1.cos(), f1.sin()], f2, f3 });
        assert_eq!(at(-std::f64::consts::PI + 1e-9, -1.0, -1.0), [0, 11, 22]);
        assert_eq!(at(0.0, 0.0, 0.0), [5, 16, 27]);
        assert_eq!(at(std::f64::consts::PI, 1.0 + 1e-15, 1.0), [10, 21, 32]);
    }

    #[test]
    fn angles_fall_into_eleven_even_bins() {
        for step in 0..2000 {
            let f1 = -std::f64::consts::PI + (f64::from(step) + 0.5) * std::f64::consts::TAU / 2000.0;
            let expected = ((f1 / std::f64::consts::TAU + 0.5) * 11.0) as usize;
            assert_eq!(bins(&PairFeatures { turn: [3.0 * f1.cos(), 3.0 * f1.sin()], f2: 0.0, f3: 0.0 })[0], expected);
        }
    }

    #[test]
    fn all_at_once_and_one_by_one_are_the_same() {
        let surface = crate::testing::bumpy(25, 3);
        for needed in [vec![true; surface.len()], (0..surface.len()).map(|i| i % 3 == 0).collect::<Vec<_>>()] {
            let all = pair_histograms(&surface, &needed, 0.2);
            for i in (0..surface.len()).filter(|&i| needed[i]) {
                assert_eq!(all[i], pair_histogram(&surface, i as u32, 0.2));
            }
        }
    }
}
