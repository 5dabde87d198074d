//! The sampling of SAC-IA (Rusu et al. 2009): three points far apart, with a random candidate of each.

use crate::HypothesisGenerator;
use congruent_geometry::random::Stream;
use congruent_geometry::{Point, RigidTransform, fit_three, narrow};
use congruent_metrics::Evidence;
use nalgebra::Vector3;

/// Maximum number of draws per trial: degenerate samples are drawn again and do not count as trials.
const MAX_REDRAWS: usize = 100;
/// More fruitless draws than this per source point halve the distance; value from the Point Cloud Library.
const FRUITLESS_PER_POINT: usize = 3;
/// Number of halvings that reduce any useful distance to nothing.
const MAX_HALVINGS: u32 = 30;

/// Poses from three source points that keep a minimum distance, each with one of the target points it is paired with.
///
/// A source point with many candidates is drawn no more often than one with a single candidate.
pub struct SacIa<'a> {
    evidence: &'a Evidence,
    /// The pairs of each source point, in order of its first pair.
    candidates: Vec<Vec<u32>>,
    min_distance: f64,
    trials: u64,
    seed: u64,
}

impl<'a> SacIa<'a> {
    /// Creates a generator with `min_distance` in data units. Fewer than three source points propose nothing.
    #[must_use]
    pub fn new(evidence: &'a Evidence, min_distance: f64, trials: u64, seed: u64) -> Self {
        SacIa { evidence, candidates: by_source_point(evidence), min_distance, trials, seed }
    }

    fn sample(&self, stream: &mut Stream) -> Option<[usize; 3]> {
        let (mut sample, mut taken): ([usize; 3], usize) = ([0; 3], 0);
        let (mut min_distance, mut fruitless, mut halvings) = (self.min_distance, 0, 0);
        while taken < 3 {
            let candidates = &self.candidates[stream.below(self.candidates.len() as u32) as usize];
            let point = self.source(candidates[0]);
            let far = |&other: &usize| {
                let distance = (self.evidence.source(other) - point).norm();
                distance > 0.0 && distance >= min_distance
            };
            if sample[..taken].iter().all(far) {
                sample[taken] = candidates[stream.below(candidates.len() as u32) as usize] as usize;
                (taken, fruitless) = (taken + 1, 0);
                continue;
            }
            fruitless += 1;
            if fruitless > FRUITLESS_PER_POINT * self.candidates.len() {
                if halvings == MAX_HALVINGS {
                    return None;
                }
                (min_distance, fruitless, halvings) = (min_distance / 2.0, 0, halvings + 1);
            }
        }
        Some(sample)
    }

    fn source(&self, pair: u32) -> Vector3<f64> {
        self.evidence.source(pair as usize)
    }
}

impl HypothesisGenerator for SacIa<'_> {
    fn trials(&self) -> u64 {
        self.trials
    }

    fn propose(&self, trial: u64) -> Option<RigidTransform> {
        if self.candidates.len() < 3 {
            return None;
        }
        let mut stream = Stream::new(self.seed, trial);
        (0..MAX_REDRAWS).find_map(|_| {
            let sample = self.sample(&mut stream)?;
            fit_three(&sample.map(|i| self.evidence.source(i)), &sample.map(|i| self.evidence.target(i)))
        })
    }
}

/// Groups the pairs that share their source point, bit for bit.
fn by_source_point(evidence: &Evidence) -> Vec<Vec<u32>> {
    let key = |i: u32| -> [u32; 3] {
        let point: Point = narrow(&evidence.source(i as usize));
        point.map(f32::to_bits)
    };
    let mut order: Vec<u32> = (0..evidence.len() as u32).collect();
    order.sort_by_key(|&i| key(i));
    let mut groups: Vec<Vec<u32>> = order.chunk_by(|&a, &b| key(a) == key(b)).map(<[u32]>::to_vec).collect();
    groups.sort_by_key(|group| group[0]);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty points on a wavy line, one apart, each with two candidates: itself and a lifted point.
    fn line() -> Evidence {
        let point = |i: u32| [i as f32, (i * i % 7) as f32 * 0.1, 0.0];
        let lifted = |i: u32| [i as f32, (i * i % 7) as f32 * 0.1, 5.0];
        Evidence::new((0..40).map(|i| (point(i / 2), if i % 2 == 0 { point(i / 2) } else { lifted(i / 2) })))
    }

    #[test]
    fn candidates_are_grouped_by_their_source_point_in_ranking_order() {
        let point = |x: f32| [x, 0.0, 0.0];
        let evidence = Evidence::new(
            [(5.0, 1.0), (3.0, 1.0), (5.0, 2.0), (4.0, 1.0), (3.0, 9.0)].map(|(p, q)| (point(p), point(q))),
        );
        assert_eq!(by_source_point(&evidence), [vec![0, 2], vec![1, 4], vec![3]]);
    }

    #[test]
    fn points_keep_their_distance_and_all_candidates_have_their_turn() {
        let evidence = line();
        // If the first two are 7 to 11 apart near the middle there is no third, and the distance is halved once.
        let generator = SacIa::new(&evidence, 6.0, 10, 1);
        let mut stream = Stream::new(1, 0);
        let (mut lifted, mut kept) = (0, 0);
        for _ in 0..500 {
            let sample = generator.sample(&mut stream).unwrap();
            let edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| evidence.source(sample[a]) - evidence.source(sample[b]));
            assert!(edges.iter().all(|edge| edge.norm() >= 3.0));
            kept += u32::from(edges.iter().all(|edge| edge.norm() >= 6.0));
            lifted += sample.iter().filter(|&&i| i % 2 == 1).count();
        }
        // 750 are expected, with a standard deviation of 19.
        assert!(lifted.abs_diff(750) < 120, "{lifted}");
        assert!(kept > 350, "{kept} of 500 keep the whole distance");
    }

    #[test]
    fn a_distance_that_cannot_be_kept_is_halved() {
        let evidence = line();
        let mut stream = Stream::new(2, 0);
        // No three of them are 15 apart; at half that distance some are.
        let sample = SacIa::new(&evidence, 15.0, 10, 1).sample(&mut stream).unwrap();
        let closest = [(0, 1), (1, 2), (2, 0)]
            .map(|(a, b)| (evidence.source(sample[a]) - evidence.source(sample[b])).norm())
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!((3.75..15.0).contains(&closest), "{closest}");
    }

    #[test]
    fn too_few_or_degenerate_points_propose_nothing() {
        let on_a_line = |n: u32| Evidence::new((0..n).map(|i| ([i as f32, 0.0, 0.0], [i as f32, 0.0, 0.0])));
        for n in [0, 1, 2, 3, 10] {
            assert!(SacIa::new(&on_a_line(n), 1.0, 10, 0).propose(0).is_none());
        }
        // Many pairs, two source points.
        let two = Evidence::new((0..10).map(|i| ([(i % 2) as f32, 0.0, 0.0], [i as f32, (i * i) as f32, 0.0])));
        assert!(SacIa::new(&two, 0.5, 10, 0).propose(0).is_none());
    }
}
