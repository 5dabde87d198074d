//! Refines a pose that was found on few points, using the many points of an earlier attempt.
//!
//! Few points of a noisy scan show clearly what many do not, because each is the mean of more measurements; many points
//! show its position more exactly.

use crate::chain::{Answer, Chain};
use crate::memory::SampledPair;
use crate::ranking::{Ranked, Ranking};
use crate::refining::drawn_in;
use crate::verdict::CONTRADICTED_CONFIDENCE;
use crate::{AContrarioConfig, Failure, Pair, RankingConfig, Stage};
use congruent_geometry::{Surface, roughness};
use congruent_metrics::DenseAgreement;

/// Ratio of the resolutions from which one sample has few points and the other has many.
const MUCH_FINER: f64 = 1.5;
/// Minimum number of points of a coarse sample: with fewer, a scan is only a handful of blobs, which fit other such
/// blobs.
const FEWEST: usize = 500;
/// Search radius on many points at first, in `pr` of the few.
const RADIUS: f64 = 2.0;
/// Maximum distance between two dense samples of one surface, as a multiple of their roughness: 1.0 to 1.7 for scans
/// under noise and for rooms, 2.2 to 9 for scans and their mirror images.
const FAR_APART: f64 = 2.5;
/// Minimum fraction of the many points that contradict a pose because of details that the few do not show. Noise and edges
/// contradict less the more points there are, furniture that was put against the wrong wall more: of six right poses 0.3
/// to 0.7 times as many of the many points as of the few contradict, of nine wrong ones in rooms 1.3 to 5.5 times as many,
/// 0.09 to 0.14 of them.
const MIN_FLOATING: f64 = 0.05;
/// Minimum overlap of the many points, as a fraction of that of the few, if both show the same surface: 0.77 to 0.97 in
/// rooms, 0.37 to 0.6 for sweeps of spinning scanners with few rings.
const SAME_SURFACE: f64 = 0.7;

impl Chain<'_, '_> {
    /// Checks that a coarse sample has enough points to be used.
    ///
    /// # Errors
    /// An earlier attempt used a much finer sample, and one scan now has too few points.
    pub(crate) fn enough_points(&self) -> Result<(), Failure> {
        let counts = [
            (self.counts.sampled.source, self.counts.points.source),
            (self.counts.sampled.target, self.counts.points.target),
        ];
        let (left, of) = counts.into_iter().min().expect("two scans");
        let finest = self.memory.finest().map_or(f64::INFINITY, |(_, finest)| finest.resolution);
        let is_few = MUCH_FINER * finest < self.resolution;
        if is_few && left < FEWEST { Err(Failure::FewPoints { left, of }) } else { Ok(()) }
    }

    /// Refines the answer on the finest surfaces of earlier attempts, if they are much finer, and takes the result if
    /// it fits them better. The judgement remains that of the few points, unless details that only the many points show
    /// contradict the answer: then it is not accepted.
    ///
    /// # Errors
    /// No more correspondences are inliers than chance explains: a few points may fit by accident. Or the many points
    /// fit better in a substantially different pose, which the few do not refute. Or the many points are farther apart
    /// than they are rough: the shapes are only similar.
    pub(crate) fn sharpened(&mut self, answer: Answer, on_few: &Ranked, few: &Ranking<'_>) -> Result<Answer, Failure> {
        let finest = self.memory.finest().filter(|(_, finest)| MUCH_FINER * finest.resolution < self.resolution);
        let Some((sampling, SampledPair { prepared, resolution, .. })) = finest.cloned() else { return Ok(answer) };
        let fields = self.memory.fields.get(&sampling);
        let best_before = self.memory.best.get(&(sampling, self.signs));
        let (Some(prepared), Some(fields), Some(best_before), RankingConfig::Dense(dense)) =
            (prepared.with_signs(self.signs), fields, best_before, &self.config.ranking)
        else {
            return Ok(answer);
        };
        if let (_, Some(doubt)) = answer.significance.judge(&AContrarioConfig::default()) {
            return Err(self.bounded(doubt));
        }
        let (surfaces, viewpoints) = (&prepared.surfaces, prepared.trusted_viewpoints());
        let many = Ranking::new(surfaces, &fields, &viewpoints, dense, self.bounds.clone(), resolution);
        let (rough, radius) = (&answer.target_from_source, RADIUS * self.resolution);
        let freedom = self.bounds.freedom();
        let drawn = self.clock.time(Stage::Refinement, || drawn_in(surfaces, rough, radius, freedom, resolution));
        let start = self.bounds.admitted(&drawn).unwrap_or(*rough);
        let refined = self.refined(surfaces, &start, resolution);
        let (before, after) = (many.judge(rough), many.judge(&refined.target_from_source));
        let found = if after.score.value() > before.score.value() { after } else { before };

        let fits_worse = found.score.value() < best_before.score.value() && many.apart(&found, &best_before);
        let other_on_few = few.judge(&best_before.target_from_source);
        if fits_worse && self.config.verdict.comes_close(other_on_few.score.value(), on_few.score.value()) {
            return Err(self.bounded(Failure::Contradicted));
        }
        if let Some(times) = times_too_far_apart(&found.agreement, surfaces) {
            return Err(self.bounded(Failure::OnlyAlike { times }));
        }
        let mut judgement = answer.judgement;
        if let Some(floating) = floating_details(&on_few.agreement, &found.agreement) {
            judgement.confidence = judgement.confidence.min(CONTRADICTED_CONFIDENCE);
            judgement.doubt.get_or_insert(self.bounded(floating));
        }
        let uncertainty = if found.target_from_source == *rough { answer.uncertainty } else { refined.uncertainty };
        Ok(Answer { target_from_source: found.target_from_source, uncertainty, judgement, ..answer })
    }
}

/// Returns the doubt if the many points contradict the pose, and more of them than of the few. `None` if they do not show the
/// same surface in more detail: if much less of them overlaps (rings with gaps in between, normals on the wrong side), or if
/// more of their normals disagree (noise, which the few average out).
fn floating_details(few: &DenseAgreement, many: &DenseAgreement) -> Option<Failure> {
    let [few_floating, many_floating] = [few, many].map(DenseAgreement::contradictions);
    let is_more = many_floating > few_floating && many_floating > MIN_FLOATING;
    let is_detailed = many.overlap > SAME_SURFACE * few.overlap && many.disagreeing <= few.disagreeing;
    (is_more && is_detailed).then_some(Failure::FloatingDetails { few: few_floating, many: many_floating })
}

/// Returns the distance between the surfaces where they touch as a multiple of their roughness, if it is too large.
/// `None` if more of the points touch with normals that disagree than with normals that agree: the normals are then on
/// the wrong side, and the rest tells nothing.
fn times_too_far_apart(touch: &DenseAgreement, surfaces: &Pair<Surface>) -> Option<f64> {
    let rough = surfaces.as_ref().par_map(roughness);
    let times = touch.residual / (0.5 * (rough.source? + rough.target?));
    (times > FAR_APART && touch.overlap > touch.disagreeing).then_some(times)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_geometry::{NeighborIndex, Point};

    /// Two sheets of 40 × 40 points with noise of standard deviation 0.1.
    fn sheets() -> Pair<Surface> {
        let sheet = |seed: u64| {
            let mut stream = Stream::new(seed, 0);
            let points: Vec<Point> =
                (0..1600u16).map(|i| [f32::from(i % 40), f32::from(i / 40), (0.1 * stream.normal()) as f32]).collect();
            let index = NeighborIndex::new(&points);
            Surface::new(points, vec![[0.0, 0.0, 1.0]; 1600], index, 1.0)
        };
        Pair { source: sheet(1), target: sheet(2) }
    }

    #[test]
    fn details_that_float_only_among_many_points_refute_a_pose() {
        let floating = |overlap: f64, floating: f64| DenseAgreement {
            hover: 0.01,
            occlusion: floating - 0.01,
            ..touch(0.1, overlap, 0.0)
        };
        let refutes = |few: f64, many: f64| floating_details(&floating(0.6, few), &floating(0.5, many));
        assert!(matches!(refutes(0.02, 0.12), Some(Failure::FloatingDetails { .. })));
        assert!(refutes(0.15, 0.12).is_none() && refutes(0.01, 0.04).is_none() && refutes(0.01, 0.01).is_none());
        // Of rings, or with normals on the wrong side, much less overlaps; under noise more normals disagree.
        assert!(floating_details(&floating(0.8, 0.02), &floating(0.4, 0.12)).is_none());
        let noisy = DenseAgreement { disagreeing: 0.1, ..floating(0.5, 0.12) };
        assert!(floating_details(&floating(0.6, 0.02), &noisy).is_none());
    }

    fn touch(residual: f64, overlap: f64, disagreeing: f64) -> DenseAgreement {
        DenseAgreement {
            soft_overlap: 0.5,
            overlap,
            residual,
            hover: 0.0,
            occlusion: 0.0,
            disagreeing,
            normal_angle: 0.1,
        }
    }

    #[test]
    fn surfaces_farther_apart_than_they_are_rough_are_only_alike() {
        let both = sheets();
        // Their roughness is about 0.08.
        assert_eq!(times_too_far_apart(&touch(0.1, 0.6, 0.0), &both), None);
        let times = times_too_far_apart(&touch(0.4, 0.6, 0.0), &both).unwrap();
        assert!((4.0..6.0).contains(&times), "{times}");
        // If normals are on the wrong side, or nothing touches, no statement is possible.
        assert_eq!(times_too_far_apart(&touch(0.4, 0.01, 0.4), &both), None);
        assert_eq!(times_too_far_apart(&touch(f64::INFINITY, 0.0, 0.0), &both), None);
    }
}
