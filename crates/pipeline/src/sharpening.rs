//! A pose that was found on few points, laid on the many that an earlier attempt looked at.
//!
//! Few points of a noisy scan show clearly what many do not, since each is the mean of more; many show more exactly where it is.

use crate::chain::{Answer, Chain};
use crate::memory::SampledPair;
use crate::ranking::{Ranked, Ranking};
use crate::refining::drawn_in;
use crate::{AContrarioConfig, Failure, Pair, RankingConfig, Stage};
use congruent_geometry::{Surface, roughness};
use congruent_metrics::DenseAgreement;

/// From this ratio of the resolutions on, points are few and many.
const MUCH_FINER: f64 = 1.5;
/// With fewer points than this a scan is no surface any more but a handful of blobs, and they fit alike ones.
const FEWEST: usize = 500;
/// How far a pose is looked around on many points at first, in `pr` of the few.
const RADIUS: f64 = 2.0;
/// Many points of one surface lie at most so many times as far apart as they are rough: 1.0 to 1.7 times for scans under noise
/// and rooms, 2.2 to 9 times for scans and their images in a mirror.
const FAR_APART: f64 = 2.5;

impl Chain<'_, '_> {
    /// Whether there are points enough to look at few of them.
    ///
    /// # Errors
    /// The scans were looked at much more finely before, and now one of them is hardly there.
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

    /// The answer, refined on the finest surfaces of the attempts before if they are much finer and if it then fits them better. The
    /// judgement remains that of the few points.
    ///
    /// # Errors
    /// No more correspondences agree than chance explains: a few points may fit by accident. Or the many points fit better in a
    /// really different pose, which the few do not refute. Or they lie farther apart than they are rough: alike shapes.
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
        let many = Ranking::new(surfaces, &fields, &viewpoints, dense, self.bounds, resolution);
        let (rough, radius) = (&answer.target_from_source, RADIUS * self.resolution);
        let freedom = self.bounds.freedom();
        let drawn = self.clock.time(Stage::Refinement, || drawn_in(surfaces, rough, radius, freedom, resolution));
        let start = self.bounds.admitted(&drawn, resolution).unwrap_or(*rough);
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
        let uncertainty = if found.target_from_source == *rough { answer.uncertainty } else { refined.uncertainty };
        Ok(Answer { target_from_source: found.target_from_source, uncertainty, ..answer })
    }
}

/// How many times as far apart as they are rough surfaces lie where they touch, if that is too many. Nothing where more of them touch
/// with normals that disagree: then their sides are mistaken, and what is left says nothing.
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

    /// Two sheets of 40 × 40 points under noise of 0.1.
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
        // They are rough by about 0.08.
        assert_eq!(times_too_far_apart(&touch(0.1, 0.6, 0.0), &both), None);
        let times = times_too_far_apart(&touch(0.4, 0.6, 0.0), &both).unwrap();
        assert!((4.0..6.0).contains(&times), "{times}");
        // Where sides are mistaken, and where nothing touches, there is nothing to go by.
        assert_eq!(times_too_far_apart(&touch(0.4, 0.01, 0.4), &both), None);
        assert_eq!(times_too_far_apart(&touch(f64::INFINITY, 0.0, 0.0), &both), None);
    }
}
