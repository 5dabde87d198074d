//! Refines a pose that was found on few points, using the many points of an earlier attempt.
//!
//! Few points of a noisy scan show clearly what many do not, because each is the mean of more measurements; many points
//! show its position more exactly.

use crate::chain::{Answer, Chain};
use crate::details::{floating_details, times_too_far_apart};
use crate::memory::SampledPair;
use crate::ranking::{Ranked, Ranking};
use crate::refining::drawn_in;
use crate::verdict::CONTRADICTED_CONFIDENCE;
use crate::{AContrarioConfig, Failure, RankingConfig, Stage};

/// Ratio of the resolutions from which one sample has few points and the other has many.
const MUCH_FINER: f64 = 1.5;
/// Minimum number of points of a coarse sample: with fewer, a scan is only a handful of blobs, which fit other such
/// blobs.
const FEWEST: usize = 500;
/// Search radius on many points at first, in `pr` of the few.
const RADIUS: f64 = 2.0;

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
