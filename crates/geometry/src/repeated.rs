//! Points that coincide with an earlier one.

use crate::{Point, Spare};
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;

/// Approximate number of points compared with each other at a time, so that their table stays in the cache.
const POINTS_OF_A_PART: usize = 1 << 15;
/// Number of lowest bits of a hash that tell most points of a part apart: sixteen times as many values as there are
/// points.
const SEEN_BITS: u32 = 19;
/// Number of points that one thread hashes at a time.
const HASHED_AT_A_TIME: usize = 1 << 14;
/// Number of lowest bits not used to choose a part: a hash table picks its slots by the lowest and highest bits, parts
/// are chosen by bits in between.
const MIDDLE_BITS: u32 = 24;

/// The coordinates of a point as bits, irrespective of the sign of zero.
type Place = [u32; 3];

/// Returns each point (position) that coincides exactly with an earlier one, with the first one there; ascending.
/// Points that are NaN coincide with nothing.
pub(crate) fn repeated(points: &[Point]) -> Vec<(u32, u32)> {
    let parts = Parts::by_place(points);
    let spare = Spare::<Comparison>::default();
    let of_part = |part: &[u32]| spare.with(|comparison| comparison.repeated(points, part));
    let mut found: Vec<(u32, u32)> = parts.all().into_par_iter().map(of_part).flatten_iter().collect();
    found.par_sort_unstable();
    found
}

/// Buffers reused from one part to the next.
#[derive(Default)]
struct Comparison {
    /// One bit for all hashes that agree in their lowest bits: whether there is such a point …
    seen: Vec<u64>,
    /// … and whether there are two.
    seen_twice: Vec<u64>,
    known: FxHashMap<Place, u32>,
}

impl Comparison {
    /// Looks up in a table only the few points whose hash may equal that of another point.
    fn repeated(&mut self, points: &[Point], part: &[u32]) -> Vec<(u32, u32)> {
        let Comparison { seen, seen_twice, known } = self;
        for bits in [&mut *seen, &mut *seen_twice] {
            bits.clear();
            bits.resize(1 << (SEEN_BITS - 6), 0);
        }
        let hashes: Vec<u32> =
            part.iter().map(|&i| hash(&points[i as usize]) as u32 & ((1 << SEEN_BITS) - 1)).collect();
        for hash in &hashes {
            let (word, bit) = ((hash / 64) as usize, 1 << (hash % 64));
            seen_twice[word] |= seen[word] & bit;
            seen[word] |= bit;
        }
        let is_alone = |hash: u32| seen_twice[(hash / 64) as usize] >> (hash % 64) & 1 == 0;
        known.clear();
        let mut found = Vec::new();
        for (&i, _) in part.iter().zip(&hashes).filter(|(_, hash)| !is_alone(**hash)) {
            let point = points[i as usize];
            let first = *known.entry(place(&point)).or_insert(i);
            if first != i && !point[0].is_nan() {
                found.push((i, first));
            }
        }
        found
    }
}

fn hash(point: &Point) -> u64 {
    FxBuildHasher.hash_one(place(point))
}

/// Returns the coordinates as bits; adding zero turns −0 into +0, so that equal numbers have equal bits.
fn place(point: &Point) -> Place {
    point.map(|v| (v + 0.0).to_bits())
}

/// Positions of points in parts, with equal points in the same part; ascending in each.
struct Parts {
    order: Vec<u32>,
    /// Where each part ends.
    ends: Vec<usize>,
}

impl Parts {
    fn by_place(points: &[Point]) -> Parts {
        let n_parts = points.len().div_ceil(POINTS_OF_A_PART).next_power_of_two();
        let part = |point: &Point| (hash(point) >> MIDDLE_BITS) as usize & (n_parts - 1);
        if n_parts == 1 {
            return Parts { order: (0..points.len() as u32).collect(), ends: vec![points.len()] };
        }
        let part_of: Vec<u32> =
            points.par_iter().with_min_len(HASHED_AT_A_TIME).map(|point| part(point) as u32).collect();
        let mut next = vec![0; n_parts];
        part_of.iter().for_each(|&part| next[part as usize] += 1);
        let mut end = 0;
        next.iter_mut().for_each(|next| end += std::mem::replace(next, end));
        let mut order = vec![0; points.len()];
        for (i, &part) in (0u32..).zip(&part_of) {
            order[next[part as usize]] = i;
            next[part as usize] += 1;
        }
        Parts { order, ends: next }
    }

    fn all(&self) -> Vec<&[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.order[start..end]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn each_repetition_is_found_with_the_first_of_its_place() {
        let mut stream = Stream::new(6, 0);
        for n in [0, 5, 1000, 3 * POINTS_OF_A_PART] {
            // Few enough distinct places that many points share one.
            let points: Vec<Point> = (0..n).map(|_| std::array::from_fn(|_| stream.below(40) as f32 - 20.0)).collect();
            let mut first_at: FxHashMap<Place, u32> = FxHashMap::default();
            let mut expected = Vec::new();
            for (i, point) in (0u32..).zip(&points) {
                let first = *first_at.entry(place(point)).or_insert(i);
                expected.extend((first != i).then_some((i, first)));
            }
            assert_eq!(repeated(&points), expected, "{n}");
            assert!(n < 1000 || expected.len() > 5, "{n}");
        }
    }

    #[test]
    fn zeros_are_equal_and_what_is_no_number_is_nowhere() {
        let points = [[0.0, 1.0, -0.0], [f32::NAN; 3], [-0.0, 1.0, 0.0], [f32::NAN; 3], [0.0, 1.0, 1.0]];
        assert_eq!(repeated(&points), [(2, 0)]);
    }
}
