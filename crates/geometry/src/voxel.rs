//! Voxel grids: one point for each occupied cell.

use crate::bounds::bounds;
use crate::{Point, narrow};
use multiversion::multiversion;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;

/// Points, with normals where the input had them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Centroids.
    pub points: Vec<Point>,
    /// Mean directions, unit length; zero where the cell's normals cancel.
    pub normals: Option<Vec<Point>>,
}

/// Steps into which a cell's side is cut where means are formed: sums of whole steps do not depend on their order.
const STEPS: f64 = (1u64 << 36) as f64;

/// A bit map of all cells has at most so many for each point; beyond that the points' cells are sorted.
const MAX_BITS_PER_POINT: usize = 256;

/// The centroid of the points in each cubic cell of side `leaf`; cells are `floor(x / leaf)` on each axis.
///
/// Sorted by cell. Neither the result nor a bit of it depends on the order of the points. A leaf below 2⁻⁵⁰ of the largest
/// coordinate counts as that.
#[must_use]
pub fn voxel_centroids(points: &[Point], normals: Option<&[Point]>, leaf: f64) -> Sample {
    let leaf = usable(points, leaf);
    let groups = match Packing::of(points, leaf) {
        Some(packing) => match packing.few_keys(usize::MAX) {
            Some(_) => Groups::by_digits(&packing.keys(points, leaf), packing.bits.iter().sum()),
            None => Groups::sorted(points, |p| packing.key(&cell(p, leaf))),
        },
        None => Groups::sorted(points, |p| cell(p, leaf)),
    };
    centroids(points, normals, leaf, &groups)
}

/// How many centroids there would be.
#[must_use]
pub fn voxel_count(points: &[Point], leaf: f64) -> usize {
    let leaf = usable(points, leaf);
    match Packing::of(points, leaf) {
        Some(packing) => match packing.few_keys(MAX_BITS_PER_POINT * points.len()) {
            Some(n) => marked(&packing.keys(points, leaf), n),
            None => distinct(points, |p| packing.key(&cell(p, leaf))),
        },
        None => distinct(points, |p| cell(p, leaf)),
    }
}

type Cell = [i64; 3];

/// Keys that one thread makes at a time, and groups that it averages.
const KEYS_AT_A_TIME: usize = 4096;
const GROUPS_AT_A_TIME: usize = 1024;
/// Bits of a key that are sorted by at a time, at most.
const DIGIT: u32 = 11;
/// So many numbers of steps are summed without rounding in `f64`.
const MAX_SUMMED: usize = 1 << 16;

/// Finer cells could not be numbered.
fn usable(points: &[Point], leaf: f64) -> f64 {
    let (low, high) = bounds(points);
    let largest = (0..3).fold(0.0f32, |largest, axis| largest.max(-low[axis]).max(high[axis]));
    leaf.max(f64::from(largest) * 2f64.powi(-50))
}

#[inline]
fn cell(p: &Point, leaf: f64) -> Cell {
    p.map(|v| {
        let place = f64::from(v) / leaf;
        // The floor, without a call.
        let towards_zero = place as i64;
        towards_zero - i64::from(place < towards_zero as f64)
    })
}

/// Cells as single numbers in the same order, where all of a cloud's fit.
struct Packing {
    low: Cell,
    bits: [u32; 3],
}

impl Packing {
    fn of(points: &[Point], leaf: f64) -> Option<Packing> {
        let (low, high) = Some(bounds(points)).filter(|_| !points.is_empty())?;
        let (low, high) = (cell(&low, leaf), cell(&high, leaf));
        let bits = std::array::from_fn(|k| u64::BITS - high[k].abs_diff(low[k]).leading_zeros());
        (bits.iter().sum::<u32>() <= u64::BITS).then_some(Packing { low, bits })
    }

    /// One more than the largest key, where that is not above the limit.
    fn few_keys(&self, limit: usize) -> Option<usize> {
        let n = 1usize.checked_shl(self.bits.iter().sum())?;
        (n <= limit && n <= 1 << 31).then_some(n)
    }

    /// The keys of all points, where there are few.
    fn keys(&self, points: &[Point], leaf: f64) -> Vec<u32> {
        let mut keys = vec![0; points.len()];
        let shifts = [self.bits[1] + self.bits[2], self.bits[2], 0];
        let low = self.low.map(|low| low as f64);
        let blocks = keys.par_chunks_mut(KEYS_AT_A_TIME).zip(points.par_chunks(KEYS_AT_A_TIME));
        blocks.for_each(|(keys, points)| small_keys(points, leaf, low, shifts, keys));
        keys
    }

    #[inline]
    fn key(&self, cell: &Cell) -> u64 {
        // A shift by 64 comes only with a cell that is zero.
        (0..3).fold(0, |key: u64, axis| {
            key.checked_shl(self.bits[axis]).unwrap_or(0) | cell[axis].abs_diff(self.low[axis])
        })
    }
}

/// As [`Packing::key`], of keys below 2³¹.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn small_keys(points: &[Point], leaf: f64, low: [f64; 3], shifts: [u32; 3], keys: &mut [u32]) {
    for (key, point) in keys.iter_mut().zip(points) {
        // Below 2⁵³, so the difference is exact.
        let steps: [u32; 3] =
            std::array::from_fn(|axis| ((f64::from(point[axis]) / leaf).floor() - low[axis]) as i32 as u32);
        *key = steps[0] << shifts[0] | steps[1] << shifts[1] | steps[2];
    }
}

/// How many different keys there are, by a bit for each.
fn marked(keys: &[u32], n_keys: usize) -> usize {
    let mut marks = vec![0u64; n_keys.div_ceil(64)];
    for key in keys {
        marks[(key / 64) as usize] |= 1 << (key % 64);
    }
    marks.iter().map(|word| word.count_ones() as usize).sum()
}

/// The same by sorting.
fn distinct<K: Ord + Send + Sync>(points: &[Point], key: impl Fn(&Point) -> K + Send + Sync) -> usize {
    let mut keys: Vec<K> = points.par_iter().map(key).collect();
    keys.par_sort_unstable();
    keys.chunk_by(|a, b| a == b).count()
}

/// Positions of points by cell.
struct Groups {
    order: Vec<u32>,
    /// Where each group ends; none is empty.
    ends: Vec<usize>,
}

impl Groups {
    /// Sorts digit by digit, the last first.
    fn by_digits(keys: &[u32], bits: u32) -> Groups {
        let mut members: Vec<(u32, u32)> = keys.iter().copied().zip(0u32..).collect();
        let mut sorted = vec![(0, 0); members.len()];
        let width = bits.div_ceil(bits.div_ceil(DIGIT).max(1)).max(1);
        for shift in (0..bits).step_by(width as usize) {
            let digit = |key: u32| (key >> shift) as usize & ((1 << width) - 1);
            let mut next = vec![0u32; 1 << width];
            members.iter().for_each(|&(key, _)| next[digit(key)] += 1);
            let mut sum = 0;
            next.iter_mut().for_each(|count| sum += std::mem::replace(count, sum));
            for &member in &members {
                let place = &mut next[digit(member.0)];
                sorted[*place as usize] = member;
                *place += 1;
            }
            std::mem::swap(&mut members, &mut sorted);
        }
        Groups::of(&members)
    }

    fn sorted<K: Ord + Copy + Send + Sync>(points: &[Point], key: impl Fn(&Point) -> K + Send + Sync) -> Groups {
        let mut members: Vec<(K, u32)> = points.par_iter().map(key).zip(0u32..points.len() as u32).collect();
        members.par_sort_unstable_by_key(|member| member.0);
        Groups::of(&members)
    }

    fn of<K: Eq>(members: &[(K, u32)]) -> Groups {
        let sizes = members.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len);
        let ends = sizes.scan(0, |end, size| {
            *end += size;
            Some(*end)
        });
        Groups { ends: ends.collect(), order: members.iter().map(|member| member.1).collect() }
    }

    fn group(&self, number: usize) -> &[u32] {
        &self.order[self.start(number)..self.start(number + 1)]
    }

    /// Where a group begins, and the end of the last one at last.
    fn start(&self, number: usize) -> usize {
        if number == 0 { 0 } else { self.ends[number - 1] }
    }
}

fn centroids(points: &[Point], normals: Option<&[Point]>, leaf: f64, groups: &Groups) -> Sample {
    let mean_normal = |normals: &[Point], number: usize| {
        let sum = groups.group(number).iter().fold([0i64; 3], |sum, &i| {
            let normal = normals[i as usize];
            std::array::from_fn(|k| sum[k] + (f64::from(normal[k]) * STEPS) as i64)
        });
        let sum = Vector3::from(sum.map(|steps| steps as f64 / STEPS));
        narrow(&sum.try_normalize(1e-6).unwrap_or_default())
    };
    let numbers: Vec<usize> = (0..groups.ends.len()).collect();
    let some_centroids = |some: &[usize]| centroids_of(points, leaf, groups, some[0]..some[0] + some.len());
    Sample {
        points: numbers.par_chunks(GROUPS_AT_A_TIME).flat_map_iter(some_centroids).collect(),
        normals: normals.map(|normals| numbers.par_iter().map(|&number| mean_normal(normals, number)).collect()),
    }
}

/// Of the groups of these numbers.
fn centroids_of(points: &[Point], leaf: f64, groups: &Groups, numbers: Range<usize>) -> Vec<Point> {
    let start = groups.start(numbers.start);
    let order = &groups.order[start..groups.start(numbers.end)];
    let members: Vec<Point> = order.iter().map(|&i| points[i as usize]).collect();
    let mut steps = vec![[0.0; 3]; members.len()];
    steps_within(members.as_flattened(), leaf, steps.as_flattened_mut());
    let centroid = |number: usize| {
        let own = groups.start(number) - start..groups.start(number + 1) - start;
        let (corner, own) = (cell(&members[own.start], leaf).map(|c| c as f64), &steps[own]);
        let sum: [f64; 3] = if own.len() <= MAX_SUMMED {
            own.iter().fold([0.0; 3], |sum, steps| std::array::from_fn(|k| sum[k] + steps[k]))
        } else {
            [0, 1, 2].map(|k| own.iter().map(|steps| steps[k] as i128).sum::<i128>() as f64)
        };
        narrow(&Vector3::from_fn(|k, _| (corner[k] + sum[k] / STEPS / own.len() as f64) * leaf))
    };
    numbers.map(centroid).collect()
}

/// For each coordinate how many steps it is beyond the corner of its cell.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn steps_within(coordinates: &[f32], leaf: f64, steps: &mut [f64]) {
    for (steps, &v) in steps.iter_mut().zip(coordinates) {
        let place = f64::from(v) / leaf;
        *steps = ((place - place.floor()) * STEPS).floor();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    fn cloud() -> Vec<Point> {
        let mut stream = Stream::new(5, 0);
        (0..2000)
            .map(|_| [stream.between(-3.0, 3.0) as f32, stream.between(-3.0, 3.0) as f32, stream.unit() as f32])
            .collect()
    }

    #[test]
    fn one_centroid_a_cell_inside_its_cell() {
        let (points, leaf) = (cloud(), 0.5);
        let cell = |p: &Point| p.map(|v| (f64::from(v) / leaf).floor() as i64);
        let mut cells: Vec<_> = points.iter().map(cell).collect();
        cells.sort();
        cells.dedup();
        let sample = voxel_centroids(&points, None, leaf);
        assert_eq!(sample.points.iter().map(cell).collect::<Vec<_>>(), cells);
    }

    #[test]
    fn the_order_of_the_points_does_not_matter() {
        let points = cloud();
        let mut reversed = points.clone();
        reversed.reverse();
        assert_eq!(voxel_centroids(&points, None, 0.7), voxel_centroids(&reversed, None, 0.7));
    }

    #[test]
    fn a_huge_or_tiny_leaf_is_fine() {
        let points = cloud();
        assert_eq!(voxel_centroids(&points, None, 1e-9).points.len(), points.len());
        assert!(voxel_centroids(&points, None, 1e9).points.len() <= 8);
        assert!(voxel_centroids(&[], None, 1.0).points.is_empty());
        assert_eq!(voxel_count(&[], 1.0), 0);
    }

    #[test]
    fn packed_or_not_the_cells_are_the_same() {
        let points = cloud();
        for leaf in [1e-30, 1e-9, 1e-4, 0.3, 0.7, 1e9] {
            let sample = voxel_centroids(&points, None, leaf);
            assert_eq!(voxel_count(&points, leaf), sample.points.len());
            let leaf = usable(&points, leaf);
            let by_cell = Groups::sorted(&points, |p| cell(p, leaf));
            assert_eq!(sample, centroids(&points, None, leaf, &by_cell), "{leaf}");
            let by_key =
                Packing::of(&points, leaf).map(|packing| Groups::sorted(&points, |p| packing.key(&cell(p, leaf))));
            assert!(by_key.is_none_or(|groups| sample == centroids(&points, None, leaf, &groups)), "{leaf}");
        }
    }

    #[test]
    fn centroids_are_means() {
        let points = cloud();
        let mean = voxel_centroids(&points, None, 1e9).points;
        let octant = |p: &&Point| p.iter().all(|v| *v >= 0.0);
        let inside: Vec<&Point> = points.iter().filter(octant).collect();
        for k in 0..3 {
            let expected = inside.iter().map(|p| f64::from(p[k])).sum::<f64>() / inside.len() as f64;
            // A cell of 10⁹ is cut into steps of 0.015.
            assert!((f64::from(mean.last().unwrap()[k]) - expected).abs() < 0.02);
        }
    }

    #[test]
    fn normals_are_averaged() {
        let sample = voxel_centroids(&[[0.1; 3], [0.2; 3]], Some(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 1.0);
        let normal = sample.normals.unwrap()[0];
        assert!((normal[0] - 0.5f32.sqrt()).abs() < 1e-6 && normal[2] == 0.0);
    }
}
