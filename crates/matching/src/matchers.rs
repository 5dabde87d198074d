//! Ways to pick correspondences from nearest neighbours.

use crate::{Candidate, Correspondence, nearest_k};
use congruent_descriptors::Features;

/// Distance of the second neighbour below which the two are the same row twice, so that no ratio can be formed.
const MIN_SECOND_DISTANCE: f32 = 1e-6;

/// Picks and ranks correspondences.
pub trait Matcher: Send + Sync {
    /// Returns ranked correspondences between surface points, best first; ties go to the closer
    /// descriptors, then to the earlier row of the source.
    fn matches(&self, source: &Features, target: &Features) -> Vec<Correspondence>;
}

/// Matches every source row with its nearest target row, closest descriptors first.
#[derive(Clone, Copy, Debug)]
pub struct Nearest;

impl Matcher for Nearest {
    fn matches(&self, source: &Features, target: &Features) -> Vec<Correspondence> {
        let mut matches = matched(source, target, &nearest_k(source, target, 2), 1, |_| true);
        matches.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        matches
    }
}

/// Matches every source row that has a ratio with its nearest target row, ranked by that (Lowe's); the best fraction is
/// kept (the paper's choice).
#[derive(Clone, Copy, Debug)]
pub struct RatioRanked {
    /// Fraction of the matches that is kept, in (0, 1]; at least three if there are three.
    pub keep: f64,
}

impl Matcher for RatioRanked {
    fn matches(&self, source: &Features, target: &Features) -> Vec<Correspondence> {
        let found = nearest_k(source, target, 2);
        let mut matches = matched(source, target, &found, 1, |row| has_ratio(&found[row]));
        rank(&mut matches);
        let kept = (self.keep * matches.len() as f64).floor() as usize;
        matches.truncate(kept.max(3));
        matches
    }
}

/// Matches rows that are each other's nearest and have a ratio, ranked by Lowe's ratio.
#[derive(Clone, Copy, Debug)]
pub struct Mutual {
    /// Maximum number of matches; the best ranked are kept.
    pub limit: usize,
}

impl Matcher for Mutual {
    fn matches(&self, source: &Features, target: &Features) -> Vec<Correspondence> {
        let forth = nearest_k(source, target, 2);
        let is_mutual = chosen_back(source, target, &forth);
        let mut matches = matched(source, target, &forth, 1, |row| is_mutual[row] && has_ratio(&forth[row]));
        rank(&mut matches);
        matches.truncate(self.limit);
        matches
    }
}

/// Returns, for each row of the source, whether its nearest row in turn finds it nearest. Only rows that were found are
/// queried.
fn chosen_back(source: &Features, target: &Features, forth: &[Vec<Candidate>]) -> Vec<bool> {
    let best = |found: &Vec<Candidate>| found.first().map(|candidate| candidate.row);
    let mut found: Vec<u32> = forth.iter().filter_map(best).collect();
    found.sort_unstable();
    found.dedup();
    let back = nearest_k(&target.chosen(&found), source, 1);
    let chooses = |target_row: u32, row: usize| {
        found.binary_search(&target_row).is_ok_and(|at| back[at].first().is_some_and(|b| b.row as usize == row))
    };
    forth
        .iter()
        .enumerate()
        .map(|(row, found)| best(found).is_some_and(|target_row| chooses(target_row, row)))
        .collect()
}

/// Matches every source row with each of its `k` nearest target rows, ranked by Lowe's ratio of the row's best two,
/// then by the candidate's own distance.
#[derive(Clone, Copy, Debug)]
pub struct TopK {
    /// Number of candidates per row.
    pub k: usize,
}

impl Matcher for TopK {
    fn matches(&self, source: &Features, target: &Features) -> Vec<Correspondence> {
        let found = nearest_k(source, target, self.k.max(2));
        let mut matches = matched(source, target, &found, self.k, |_| true);
        rank(&mut matches);
        matches
    }
}

/// Returns the matches of the rows to keep with the first `k` of their candidates, by row.
fn matched(
    source: &Features,
    target: &Features,
    found: &[Vec<Candidate>],
    k: usize,
    keep: impl Fn(usize) -> bool,
) -> Vec<Correspondence> {
    let kept = found.iter().enumerate().filter(|(row, _)| keep(*row));
    let pairs = kept.flat_map(|(row, found)| found.iter().take(k).map(move |candidate| (row, candidate, score(found))));
    let correspondence = |(row, candidate, score): (usize, &Candidate, f32)| Correspondence {
        source: source.keypoints[row],
        target: target.keypoints[candidate.row as usize],
        distance: candidate.distance,
        score,
    };
    pairs.map(correspondence).collect()
}

/// Returns whether the best two candidates of a row, if there are two, are not the same row twice.
fn has_ratio(found: &[Candidate]) -> bool {
    found.get(1).is_none_or(|second| second.distance >= MIN_SECOND_DISTANCE)
}

/// Returns the score by the ratio of the best two candidates; 0 if there is none.
fn score(found: &[Candidate]) -> f32 {
    match found {
        [first, second, ..] if has_ratio(found) => 1.0 - first.distance / second.distance,
        _ => 0.0,
    }
}

/// Sorts by score, best first; ties (all scores tie if there is one target row and thus no ratio) go to the closer
/// descriptors, then, since the sort is stable, to the earlier row of the source.
fn rank(matches: &mut [Correspondence]) {
    matches.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.distance.total_cmp(&b.distance)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    /// Rows on a line, at the given values; keypoints are numbered from `first`.
    fn line(values: &[f32], first: u32) -> Features {
        Features { keypoints: (first..first + values.len() as u32).collect(), dim: 1, rows: values.to_vec() }
    }

    fn pairs(matches: &[Correspondence]) -> Vec<(u32, u32)> {
        matches.iter().map(|m| (m.source, m.target)).collect()
    }

    fn random_features(n: usize) -> Features {
        let mut stream = Stream::new(8, 0);
        Features {
            keypoints: (0..n as u32).collect(),
            dim: 20,
            rows: (0..n * 20).map(|_| stream.unit() as f32).collect(),
        }
    }

    #[test]
    fn a_cloud_matches_itself_with_score_one() {
        let features = random_features(100);
        let matches = RatioRanked { keep: 1.0 }.matches(&features, &features);
        assert_eq!(matches.len(), 100);
        assert!(matches.iter().all(|m| m.source == m.target && m.score == 1.0 && m.distance == 0.0));
    }

    #[test]
    fn the_best_ratios_are_kept_in_order() {
        let source = line(&[0.0, 10.0, 24.0, 31.0], 100);
        let target = line(&[1.0, 5.0, 10.5, 20.0, 30.0], 200);
        let matches = RatioRanked { keep: 0.75 }.matches(&source, &target);
        // Ratios: 1/5, 0.5/5, 4/6, 1/11.
        assert_eq!(pairs(&matches), [(103, 204), (101, 202), (100, 200)]);
        assert!((matches[0].score - (1.0 - 1.0 / 11.0)).abs() < 1e-6);
    }

    #[test]
    fn at_least_three_are_kept() {
        let features = random_features(9);
        assert_eq!(RatioRanked { keep: 0.01 }.matches(&features, &features).len(), 3);
    }

    #[test]
    fn repeated_target_rows_are_dropped_where_a_ratio_is_needed() {
        let (source, target) = (line(&[0.0, 9.0], 0), line(&[0.0, 0.0, 9.0], 0));
        assert_eq!(pairs(&RatioRanked { keep: 1.0 }.matches(&source, &target)), [(1, 2)]);
        assert_eq!(pairs(&Mutual { limit: 10 }.matches(&source, &target)), [(1, 2)]);
        assert_eq!(pairs(&Nearest.matches(&source, &target)), [(0, 0), (1, 2)]);
        let matches = TopK { k: 2 }.matches(&source, &target);
        assert_eq!(pairs(&matches), [(1, 2), (1, 0), (0, 0), (0, 1)]);
        assert_eq!(matches.iter().map(|m| m.score).collect::<Vec<_>>(), [1.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn one_target_row_leaves_the_order_of_distance() {
        let matches = RatioRanked { keep: 1.0 }.matches(&line(&[3.0, 1.0, 2.0], 0), &line(&[0.0], 7));
        assert_eq!(pairs(&matches), [(1, 7), (2, 7), (0, 7)]);
        assert!(matches.iter().all(|m| m.score == 0.0));
    }

    #[test]
    fn mutual_matches_are_one_to_one() {
        let matches = Mutual { limit: 10 }.matches(&line(&[0.0, 0.4, 10.0], 0), &line(&[0.3, 11.0], 0));
        assert_eq!(pairs(&matches).len(), 2);
        assert!(pairs(&matches).contains(&(1, 0)) && pairs(&matches).contains(&(2, 1)));
        assert_eq!(Mutual { limit: 1 }.matches(&line(&[0.0, 0.4, 10.0], 0), &line(&[0.3, 11.0], 0)).len(), 1);
    }

    #[test]
    fn top_k_lists_each_candidate_once() {
        let matches = TopK { k: 2 }.matches(&line(&[0.0, 10.0], 0), &line(&[1.0, 4.0, 11.0], 0));
        let mut found = pairs(&matches);
        found.sort_unstable();
        assert_eq!(found, [(0, 0), (0, 1), (1, 1), (1, 2)]);
    }

    #[test]
    fn more_candidates_than_rows_are_all_rows() {
        let (source, target) = (random_features(5), random_features(7));
        assert_eq!(TopK { k: usize::MAX }.matches(&source, &target), TopK { k: 7 }.matches(&source, &target));
    }

    #[test]
    fn nothing_matches_nothing() {
        let (none, some) = (line(&[], 0), line(&[1.0, 2.0], 0));
        for matcher in [&Nearest as &dyn Matcher, &RatioRanked { keep: 0.3 }, &Mutual { limit: 5 }, &TopK { k: 3 }] {
            assert!(matcher.matches(&none, &some).is_empty() && matcher.matches(&some, &none).is_empty());
        }
    }
}
