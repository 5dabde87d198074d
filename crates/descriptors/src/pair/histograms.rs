//! The pairs of each point with its neighbours, counted by bin (Rusu's simplified histograms, SPFH).

use super::{BINS, DIM, NO_BINS, bins};
use congruent_geometry::{OrderedPoints, Point, Spare, Surface};
use multiversion::multiversion;
use rayon::prelude::*;
use std::ops::Range;

/// Number of cells along a radius: finer cells save distance computations, coarser ones make longer runs.
const CELLS_PER_RADIUS: f64 = 3.0;
/// Number of pairs binned at a time.
const BLOCK: usize = 64;
/// Number of pairs processed side by side.
const LANES: usize = 8;

/// A surface sorted by grid cell, one coordinate at a time.
struct Ordered {
    points: OrderedPoints,
    /// Positions and normals; longer than the cloud, so that the last lanes stay in range.
    columns: [Vec<f32>; 6],
}

impl Ordered {
    fn new(surface: &Surface, radius: f64) -> Ordered {
        let points = OrderedPoints::new(surface.points(), radius / CELLS_PER_RADIUS);
        let column = |number: usize| {
            let (of, axis) = ([surface.points(), surface.normals()][number / 3], number % 3);
            let in_order = points.cells().order().iter().map(|&i| of[i as usize][axis]);
            in_order.chain([0.0; LANES]).collect()
        };
        let columns = std::array::from_fn(column);
        Ordered { points, columns }
    }

    fn normal(&self, i: usize) -> Point {
        [self.columns[3][i], self.columns[4][i], self.columns[5][i]]
    }

    /// Counts the pairs of a needed point with the others of a run, for both points; pairs with other needed points
    /// only if those come later. `own` are the counts of the point itself, `counts` those of the places from `first`
    /// on.
    fn count(
        &self,
        i: usize,
        run: Range<usize>,
        radius_sq: f32,
        needed: &[bool],
        own: &mut [Histogram; SHARES],
        (first, counts): (usize, &mut [Histogram]),
    ) {
        let mut found = [NO_BINS; BLOCK];
        for start in run.clone().step_by(BLOCK) {
            let end = run.end.min(start + BLOCK);
            let n = (end - start).next_multiple_of(LANES);
            let columns = self.columns.each_ref().map(|column| &column[start..start + n]);
            bins_of_block(self.points.point(i), self.normal(i), columns, radius_sq, &mut found[..n]);
            for (j, &bins) in (start..end).zip(&found) {
                if bins != NO_BINS && (j > i || !needed[j]) {
                    count(&mut own[j % SHARES], bins);
                    if needed[j] {
                        count(&mut counts[j - first], bins);
                    }
                }
            }
        }
    }
}

/// Computes the bins of the pairs of one point with a block of others. Compiled for several instruction sets and chosen
/// at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn bins_of_block(
    point: Point,
    normal: Point,
    [px, py, pz, nx, ny, nz]: [&[f32]; 6],
    radius_sq: f32,
    found: &mut [u32],
) {
    // Whole lanes only, so that no remainder is left to be processed one by one.
    let n = found.len() / LANES * LANES;
    // Not in a closure, which is not always compiled for the same instruction set as the code around it.
    let (px, py, pz) = (&px[..n], &py[..n], &pz[..n]);
    let (nx, ny, nz) = (&nx[..n], &ny[..n], &nz[..n]);
    let found = &mut found[..n];
    for j in 0..n {
        let offset = [px[j] - point[0], py[j] - point[1], pz[j] - point[2]];
        found[j] = bins(normal, [nx[j], ny[j], nz[j]], offset, radius_sq);
    }
}

/// Number of pairs by bin, one block per feature; with room beyond the last bin, so that no bin can be out of range.
type Histogram = [[u32; 16]; 3];

/// Number of histograms in which one point's pairs are counted by turns: neighbours are often alike, and a number that
/// was just written is slow to read again.
const SHARES: usize = 2;

#[inline(always)]
fn count(counts: &mut Histogram, bins: u32) {
    for (block, counts) in counts.iter_mut().enumerate() {
        counts[(bins >> (8 * block) & 0xf) as usize] += 1;
    }
}

fn plus(mut sum: Histogram, more: &Histogram) -> Histogram {
    sum.as_flattened_mut().iter_mut().zip(more.as_flattened()).for_each(|(sum, more)| *sum += more);
    sum
}

fn percentages(counts: &Histogram) -> [f32; DIM] {
    let n_pairs: u32 = counts[0].iter().sum();
    let share = |i: usize| 100.0 * f64::from(counts[i / BINS][i % BINS]) / f64::from(n_pairs.max(1));
    std::array::from_fn(|i| share(i) as f32)
}

fn squared(radius: f64) -> f32 {
    radius as f32 * radius as f32
}

/// Number of parts per thread: enough that threads end at about the same time, few enough that their counts take little
/// memory.
const PARTS_A_THREAD: usize = 4;

/// The histograms of many points, stored so that those of neighbours are close in memory.
pub(crate) struct PairHistograms {
    points: OrderedPoints,
    /// By place in the order of the points.
    histograms: Vec<[f32; DIM]>,
    /// The place of each point.
    places: Vec<u32>,
    radius: f64,
    /// Places and weights of the points near a keypoint.
    spare: Spare<Vec<(u32, f64)>>,
}

impl PairHistograms {
    /// Computes the histograms of all points for which `needed` holds; zero for the others.
    ///
    /// The counts are integers, so their sums do not depend on the order of addition.
    pub(crate) fn new(surface: &Surface, needed: &[bool], radius: f64) -> Self {
        let n = surface.len();
        let ordered = Ordered::new(surface, radius);
        let needed: Vec<bool> = ordered.points.cells().order().iter().map(|&i| needed[i as usize]).collect();
        let share = n.div_ceil(PARTS_A_THREAD * rayon::current_num_threads()).max(1);
        let parts: Vec<Counts> = (0..n.div_ceil(share))
            .into_par_iter()
            .map(|part| Counts::of(&ordered, &needed, radius, part * share..n.min((part + 1) * share)))
            .collect();
        let total = |i: usize| {
            let seen = parts.iter().filter_map(|part| part.counts.get(i.checked_sub(part.first)?));
            seen.fold(Histogram::default(), plus)
        };
        let histograms = (0..n).into_par_iter().map(|i| percentages(&total(i))).collect();
        let mut places = vec![0; n];
        (0u32..).zip(ordered.points.cells().order()).for_each(|(place, &i)| places[i as usize] = place);
        PairHistograms { points: ordered.points, histograms, places, radius, spare: Spare::default() }
    }

    /// Returns the histogram of a point.
    pub(crate) fn of(&self, i: u32) -> &[f32; DIM] {
        &self.histograms[self.places[i as usize] as usize]
    }

    /// Returns the sum of all histograms within the radius of a position, weighted by 1/d²; a point at the position
    /// itself does not count.
    pub(crate) fn weighted(&self, centre: &Point) -> [f64; DIM] {
        self.spare.with(|near| {
            near.clear();
            self.points.within(centre, self.radius, |place, distance_sq| {
                if distance_sq > 0.0 {
                    near.push((place as u32, 1.0 / f64::from(distance_sq)));
                }
            });
            weighted_sum(&self.histograms, near)
        })
    }
}

/// Returns the weighted sum of histograms. Compiled for several instruction sets and chosen at run time; the bits are
/// the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn weighted_sum(histograms: &[[f32; DIM]], weights: &[(u32, f64)]) -> [f64; DIM] {
    let mut sum = [0.0; DIM];
    for &(place, weight) in weights {
        let histogram = &histograms[place as usize];
        for bin in 0..DIM {
            sum[bin] += weight * f64::from(histogram[bin]);
        }
    }
    sum
}

/// Counts of consecutive points, from the pairs of some of them.
struct Counts {
    first: usize,
    counts: Vec<Histogram>,
}

impl Counts {
    /// Counts the pairs of `some`. Of two needed points the first in the order counts for both, so nothing is counted
    /// for points before `some`.
    fn of(ordered: &Ordered, needed: &[bool], radius: f64, some: Range<usize>) -> Self {
        let (first, mut end) = (some.start, some.end);
        let mut counts = vec![Histogram::default(); needed.len() - first];
        let all_needed = needed.iter().all(|is_needed| *is_needed);
        for i in some.filter(|&i| needed[i] && ordered.normal(i) != [0.0; 3]) {
            let mut own = [Histogram::default(); SHARES];
            for run in ordered.points.cells().runs(&ordered.points.point(i), radius) {
                let start = if all_needed { run.start.max(i + 1) } else { run.start };
                let run = start..run.end.max(start);
                end = end.max(run.end);
                ordered.count(i, run, squared(radius), needed, &mut own, (first, &mut counts));
            }
            counts[i - first] = own.iter().fold(counts[i - first], plus);
        }
        // Memory that was not written to was never taken from the system.
        counts.truncate(end - first);
        Counts { first, counts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the simplified histogram (SPFH) of one point: percentages of its pairs with all neighbours, each block
    /// summing to 100; all zero if there is no pair.
    fn pair_histogram(surface: &Surface, i: u32, radius: f64) -> [f32; DIM] {
        let mut counts = Histogram::default();
        let (point, normal) = (surface.points()[i as usize], surface.normals()[i as usize]);
        if normal != [0.0; 3] {
            // On the very rim the tree may disagree with the bins, which have the last word.
            surface.index().within(&point, radius * RIM, |n| {
                let (other, its_normal) = (surface.points()[n.index as usize], surface.normals()[n.index as usize]);
                let offset = std::array::from_fn(|axis| other[axis] - point[axis]);
                let found = bins(normal, its_normal, offset, squared(radius));
                if found != NO_BINS {
                    count(&mut counts, found);
                }
            });
        }
        percentages(&counts)
    }

    /// Factor by which a radius is enlarged where rounding must lose no point.
    const RIM: f64 = 1.0 + 1e-5;

    #[test]
    fn all_at_once_and_one_by_one_are_the_same() {
        let surface = congruent_simulation::testing::bumpy(25, 3);
        for needed in [vec![true; surface.len()], (0..surface.len()).map(|i| i % 3 == 0).collect::<Vec<_>>()] {
            for radius in [0.2, 3.0] {
                let all = PairHistograms::new(&surface, &needed, radius);
                for i in (0..surface.len() as u32).filter(|&i| needed[i as usize]) {
                    assert_eq!(*all.of(i), pair_histogram(&surface, i, radius));
                }
            }
        }
    }
}
