//! The compatibility graph: which correspondences can be right together.
//!
//! A rigid motion preserves distances, and angles between normals and lines. Two correspondences that violate one of
//! these cannot both be right; so right ones are all joined to each other, and wrong ones to few.

use congruent_geometry::Point;
use congruent_metrics::Evidence;
use multiversion::multiversion;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Maximum number of rows that one thread fills at a time.
const ROWS_AT_A_TIME: usize = 32;

/// The conditions under which two correspondences are compatible; lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compatibility {
    /// Maximum difference between the two distances.
    pub tolerance: f64,
    /// Minimum of both distances: close pairs agree in any case and say little.
    pub min_distance: f64,
    /// Maximum difference of the angle between the two normals in the two scans, radians.
    pub max_angle: f64,
    /// Maximum difference of the cosine between a normal and the line to the other point.
    pub max_cosine: f64,
}

/// An undirected graph over the correspondences, one row of bits each.
pub struct Graph {
    n: usize,
    words: usize,
    bits: Vec<u64>,
}

impl Graph {
    /// Joins all compatible pairs of `evidence`. Normals are compared if both pairs have them.
    #[must_use]
    pub fn new(evidence: &Evidence, rule: &Compatibility) -> Graph {
        let n = evidence.len();
        let words = n.div_ceil(64);
        let nodes = Nodes::new(evidence, rule);
        let mut bits = vec![0u64; n * words];
        bits.par_chunks_mut(words.max(1)).enumerate().with_max_len(ROWS_AT_A_TIME).for_each(|(i, row)| {
            for (word, bits) in row.iter_mut().enumerate().skip(i / 64) {
                // Later nodes only.
                let later = if word == i / 64 { !0 << (i % 64) & !(1 << (i % 64)) } else { !0 };
                let alike = nodes.alike(i, word, rule) & later;
                let compatible = ones_of(alike).filter(|bit| nodes.normals_agree(i, word * 64 + bit, rule));
                *bits = compatible.fold(0, |bits, bit| bits | 1 << bit);
            }
        });
        let mut graph = Graph { n, words, bits };
        graph.mirror();
        graph
    }

    /// Returns the number of correspondences.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Returns whether there are no correspondences.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Returns the neighbours of `i` as bits.
    #[must_use]
    pub fn row(&self, i: usize) -> &[u64] {
        &self.bits[i * self.words..(i + 1) * self.words]
    }

    /// Returns the number of neighbours of `i`.
    #[must_use]
    pub fn degree(&self, i: usize) -> usize {
        self.row(i).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Returns the same nodes with the edges that `keep` accepts; it is called once per edge, lower node first.
    #[must_use]
    pub fn filtered(&self, keep: impl Fn(usize, usize) -> bool + Sync) -> Graph {
        let mut bits = vec![0u64; self.bits.len()];
        bits.par_chunks_mut(self.words.max(1)).enumerate().for_each(|(i, row)| {
            for j in ones(self.row(i)).filter(|&j| j > i && keep(i, j)) {
                row[j / 64] |= 1 << (j % 64);
            }
        });
        let mut graph = Graph { bits, ..*self };
        graph.mirror();
        graph
    }

    /// Returns the number of neighbours that `i` and `j` share: the second-order compatibility of an edge (Chen et al.,
    /// SC²-PCR, 2022).
    #[must_use]
    pub fn common(&self, i: usize, j: usize) -> u32 {
        shared(self.row(i), self.row(j))
    }

    /// Copies the upper triangle into the lower one, squares of 64 by 64 at a time.
    fn mirror(&mut self) {
        let (n, words) = (self.n, self.words);
        for band in 0..words {
            for word in band..words {
                let (mut square, columns) = ([0; 64], 64 * word..n.min(64 * word + 64));
                for (own, row) in square.iter_mut().zip(64 * band..n) {
                    *own = self.bits[row * words + word];
                }
                transpose(&mut square);
                for (row, bits) in columns.zip(square) {
                    self.bits[row * words + band] |= bits;
                }
            }
        }
    }
}

/// Transposes a square of bits by swapping the off-diagonal halves, then those of the halves, down to single bits.
fn transpose(square: &mut [u64; 64]) {
    let mut width = 32;
    let mut low = u64::MAX >> 32;
    while width > 0 {
        for first in (0..64).filter(|row| row & width == 0) {
            let swapped = (square[first] >> width ^ square[first + width]) & low;
            square[first] ^= swapped << width;
            square[first + width] ^= swapped;
        }
        width /= 2;
        low ^= low << width;
    }
}

/// Returns the number of bits that two rows share. Compiled for processors that count bits in one instruction, chosen
/// at run time.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512vpopcntdq+popcnt", "x86_64+avx2+popcnt", "aarch64+neon"))]
pub(crate) fn shared(a: &[u64], b: &[u64]) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a & b).count_ones()).sum()
}

/// Returns the positions of the set bits, ascending.
pub(crate) fn ones(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(at, &word)| ones_of(word).map(move |bit| at * 64 + bit))
}

/// Returns the positions of the set bits of one word.
pub(crate) fn ones_of(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (word != 0).then(|| {
            let bit = word.trailing_zeros() as usize;
            word &= word - 1;
            bit
        })
    })
}

/// The correspondences in the form needed by the pairwise test.
struct Nodes {
    /// One coordinate at a time.
    source: [Vec<f32>; 3],
    target: [Vec<f32>; 3],
    normals: Vec<Option<(Point, Point)>>,
    /// Cosine of the maximum difference between the angles of two normals.
    min_turn_cosine: f32,
}

impl Nodes {
    fn new(evidence: &Evidence, rule: &Compatibility) -> Self {
        let n = evidence.len();
        let column = |of: fn(&Evidence, usize) -> Vector3<f64>| {
            std::array::from_fn(|axis| (0..n).map(|i| of(evidence, i)[axis] as f32).collect())
        };
        Nodes {
            source: column(Evidence::source),
            target: column(Evidence::target),
            normals: (0..n).map(|i| evidence.normals(i)).collect(),
            min_turn_cosine: (rule.max_angle as f32).min(PI).cos(),
        }
    }

    /// Returns which nodes of a word are as far from `i` in the source as in the target, and far enough.
    fn alike(&self, i: usize, word: usize, rule: &Compatibility) -> u64 {
        let some = word * 64..self.normals.len().min(word * 64 + 64);
        let both = [&self.source, &self.target];
        let columns = both.map(|of| of.each_ref().map(|column| &column[some.clone()]));
        let min_sq = (rule.min_distance * rule.min_distance) as f32;
        alike(both.map(|of| at(of, i)), columns, (min_sq, rule.tolerance as f32))
    }

    /// Returns whether the normals agree with a common rotation; `true` where there are none.
    #[inline]
    fn normals_agree(&self, i: usize, j: usize, rule: &Compatibility) -> bool {
        let (Some(at_i), Some(at_j)) = (&self.normals[i], &self.normals[j]) else { return true };
        let in_source = minus(&at(&self.source, j), &at(&self.source, i));
        let in_target = minus(&at(&self.target, j), &at(&self.target, i));
        let (source_length, target_length) = (dot(&in_source, &in_source).sqrt(), dot(&in_target, &in_target).sqrt());
        let cosine = |normals: &(Point, Point)| {
            dot(&normals.0, &in_source) / source_length - dot(&normals.1, &in_target) / target_length
        };
        let most = rule.max_cosine as f32;
        cosine(at_i).abs() <= most
            && cosine(at_j).abs() <= most
            && turn_cosine(dot(&at_i.0, &at_j.0), dot(&at_i.1, &at_j.1)) >= self.min_turn_cosine
    }
}

fn at(columns: &[Vec<f32>; 3], i: usize) -> Point {
    columns.each_ref().map(|column| column[i])
}

/// Returns a bit for each of at most 64 correspondences: whether both distances from the given one are long enough and
/// similar. Compiled for several instruction sets and chosen at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn alike(from: [Point; 2], columns: [[&[f32]; 3]; 2], (min_sq, tolerance): (f32, f32)) -> u64 {
    let n = columns[0][0].len();
    let columns = columns.map(|of| of.map(|column| &column[..n]));
    let mut agree = [false; 64];
    for (j, agrees) in agree.iter_mut().enumerate().take(n) {
        let [source_sq, target_sq]: [f32; 2] = std::array::from_fn(|side| {
            let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| columns[side][axis][j] - from[side][axis]);
            x * x + y * y + z * z
        });
        let same = (source_sq.sqrt() - target_sq.sqrt()).abs() <= tolerance;
        *agrees = (source_sq >= min_sq) & (target_sq >= min_sq) & same;
    }
    agree.iter().enumerate().fold(0, |bits, (j, agrees)| bits | u64::from(*agrees) << j)
}

fn minus(a: &Point, b: &Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: &Point, b: &Point) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the cosine of the difference between two angles given by their cosines.
fn turn_cosine(a: f32, b: f32) -> f32 {
    let (a, b) = (a.clamp(-1.0, 1.0), b.clamp(-1.0, 1.0));
    a * b + ((1.0 - a * a) * (1.0 - b * b)).sqrt()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_geometry::{RigidTransform, narrow};
    use nalgebra::{Point3, Vector3};

    pub(crate) const RULE: Compatibility =
        Compatibility { tolerance: 4.0, min_distance: 8.0, max_angle: 0.45, max_cosine: 0.4 };

    /// `right` exact correspondences with normals, then wrong ones, in a box of side 200; and the true pose.
    pub(crate) fn scene(n: usize, right: usize, seed: u64) -> (Evidence, RigidTransform) {
        let mut stream = Stream::new(seed, 0);
        let truth = RigidTransform::from_parts(nalgebra::Translation3::new(15.0, -8.0, 2.0), stream.rotation());
        let (mut pairs, mut normals) = (vec![], vec![]);
        for i in 0..n {
            let mut point = || Vector3::from_fn(|_, _| stream.between(-100.0, 100.0));
            let (p, other) = (point(), point());
            let (normal, other_normal) = (point().normalize(), point().normalize());
            let (q, turned) = if i < right {
                ((truth * Point3::from(p)).coords, truth.rotation * normal)
            } else {
                (other, other_normal)
            };
            pairs.push((narrow(&p), narrow(&q)));
            normals.push((narrow(&normal), narrow(&turned)));
        }
        (Evidence::new(pairs).with_normals(normals), truth)
    }

    #[test]
    fn right_correspondences_all_know_each_other() {
        let (evidence, _) = scene(150, 40, 1);
        let graph = Graph::new(&evidence, &RULE);
        for i in 0..40 {
            let near = |j: usize| (evidence.source(i) - evidence.source(j)).norm() < RULE.min_distance;
            let expected: Vec<usize> = (0..40).filter(|&j| j != i && !near(j)).collect();
            let found: Vec<usize> = ones(graph.row(i)).filter(|&j| j < 40).collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn the_graph_is_symmetric_without_loops_and_counts_common_neighbours() {
        let (evidence, _) = scene(130, 30, 2);
        let graph = Graph::new(&evidence, &RULE);
        let has = |i: usize, j: usize| graph.row(i)[j / 64] >> (j % 64) & 1 == 1;
        for i in 0..130 {
            assert!(!has(i, i));
            for j in 0..130 {
                assert_eq!(has(i, j), has(j, i));
            }
        }
        let by_hand = (0..130).filter(|&k| has(3, k) && has(7, k)).count();
        assert_eq!(graph.common(3, 7) as usize, by_hand);
    }

    #[test]
    fn normals_thin_the_graph() {
        let (evidence, _) = scene(200, 0, 3);
        let plain = Evidence::new((0..200).map(|i| (narrow(&evidence.source(i)), narrow(&evidence.target(i)))));
        let edges = |e: &Evidence| (0..200).map(|i| ones(Graph::new(e, &RULE).row(i)).count()).sum::<usize>();
        assert!(edges(&evidence) * 4 < edges(&plain));
    }

    #[test]
    fn nothing_makes_an_empty_graph() {
        assert!(Graph::new(&Evidence::default(), &RULE).is_empty());
    }
}
