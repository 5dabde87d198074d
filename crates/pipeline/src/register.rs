//! The chain from two scans to one pose.

use crate::preparation::{raw_resolutions, sample};
use crate::stage::Clock;
use crate::verdict::Significance;
use crate::{Counts, Failure, Pair, PipelineConfig, Registration, Stage, Verdict};
use congruent_descriptors::Features;
use congruent_estimators::{Hypothesis, sample as sample_hypotheses};
use congruent_geometry::{RigidTransform, Scan, Surface, uncentred};
use congruent_matching::Correspondence;
use congruent_metrics::{Clouds, Evidence};

/// Registers two scans: keypoints, descriptors, matches, and the hypothesis that the metric likes best.
///
/// `observe` is told each stage as it begins. The result is the same, bit for bit, on any number of threads; it runs
/// on rayon's current pool. A pair that cannot be registered is an answer too, with the reason in its verdict.
#[must_use]
pub fn register(source: &Scan, target: &Scan, config: &PipelineConfig, observe: &dyn Fn(Stage)) -> Registration {
    let scans = Pair { source, target };
    let mut run = Run {
        scans,
        config,
        clock: Clock::new(observe),
        counts: Counts::default(),
        raw_resolution: 0.0,
        resolution: 0.0,
    };
    run.counts.points = scans.map(|scan| scan.points().len());
    let outcome = run.chain();
    run.registration(outcome)
}

/// The best pose, and how surprising it is.
struct Answer {
    hypothesis: Hypothesis,
    significance: Significance,
}

/// One run of the chain and what it has noted so far.
struct Run<'a> {
    scans: Pair<&'a Scan>,
    config: &'a PipelineConfig,
    clock: Clock<'a>,
    counts: Counts,
    raw_resolution: f64,
    resolution: f64,
}

impl Run<'_> {
    fn chain(&mut self) -> Result<Answer, Failure> {
        let surfaces = self.surfaces()?;
        let keypoints = self.keypoints(&surfaces);
        let features = self.features(&surfaces, &keypoints)?;
        let evidence = self.evidence(&surfaces, &features)?;
        let best = self.best_hypothesis(&surfaces, &evidence)?;
        Ok(self.judged(best, &evidence))
    }

    fn surfaces(&mut self) -> Result<Pair<Surface>, Failure> {
        let (scans, config) = (self.scans, self.config);
        let (raw, clouds) = self.clock.time(Stage::Sampling, || {
            let raw = raw_resolutions(&scans);
            (raw, sample(&scans, &config.sampling, raw, config.normals.source))
        });
        self.raw_resolution = raw.mean();
        let clouds = clouds?;
        self.resolution = Pair { source: clouds.source.resolution, target: clouds.target.resolution }.mean();
        let surfaces = self.clock.time(Stage::Normals, || {
            let (source, target) = rayon::join(
                || clouds.source.into_surface(&config.normals),
                || clouds.target.into_surface(&config.normals),
            );
            Pair { source, target }
        });
        self.counts.sampled = surfaces.map(Surface::len);
        Ok(surfaces)
    }

    fn keypoints(&mut self, surfaces: &Pair<Surface>) -> Pair<Vec<u32>> {
        let detector = self.config.detector.build(self.resolution);
        let (support, resolution) = (&self.config.support, self.resolution);
        let keypoints = self.clock.time(Stage::Keypoints, || {
            surfaces.map(|surface| {
                let found = support.apply(surface, &detector.detect(surface), resolution);
                found.iter().map(|keypoint| keypoint.index).collect()
            })
        });
        self.counts.keypoints = keypoints.map(Vec::len);
        keypoints
    }

    fn features(&mut self, surfaces: &Pair<Surface>, keypoints: &Pair<Vec<u32>>) -> Result<Pair<Features>, Failure> {
        let descriptor = self.config.descriptor.build(self.resolution);
        let features = self.clock.time(Stage::Description, || {
            surfaces
                .as_ref()
                .zip(keypoints.as_ref())
                .map(|(surface, keypoints)| descriptor.describe(surface, keypoints))
        });
        self.counts.described = features.map(Features::len);
        let fewest = self.counts.described.source.min(self.counts.described.target);
        if fewest < 3 { Err(Failure::FewKeypoints { found: fewest }) } else { Ok(features) }
    }

    fn evidence(&mut self, surfaces: &Pair<Surface>, features: &Pair<Features>) -> Result<Evidence, Failure> {
        let matcher = self.config.matcher.build();
        let matches = self.clock.time(Stage::Matching, || matcher.matches(&features.source, &features.target));
        self.counts.correspondences = matches.len();
        if matches.len() < 3 {
            return Err(Failure::FewMatches { kept: matches.len() });
        }
        let points = |m: &Correspondence| {
            (surfaces.source.points()[m.source as usize], surfaces.target.points()[m.target as usize])
        };
        Ok(Evidence::new(matches.iter().map(points)))
    }

    fn best_hypothesis(&mut self, surfaces: &Pair<Surface>, evidence: &Evidence) -> Result<Hypothesis, Failure> {
        let clouds = Clouds { source: &surfaces.source, target: &surfaces.target };
        let metric = self.config.metric.build(self.resolution, clouds);
        let (config, resolution) = (self.config, self.resolution);
        let best = self.clock.time(Stage::Estimation, || {
            let generator = config.estimator.build(evidence, resolution, config.seed);
            sample_hypotheses(generator.as_ref(), metric.as_ref(), evidence, 1)
        });
        best.into_iter().next().ok_or(Failure::NoHypothesis)
    }

    fn judged(&mut self, hypothesis: Hypothesis, evidence: &Evidence) -> Answer {
        let threshold = self.config.verdict.inlier_threshold.resolve(self.resolution);
        let trials = hypothesis.trial + 1;
        let significance = self
            .clock
            .time(Stage::Verdict, || Significance::of(&hypothesis.target_from_source, evidence, threshold, trials));
        self.counts.inliers = significance.inliers;
        Answer { hypothesis, significance }
    }

    fn registration(self, outcome: Result<Answer, Failure>) -> Registration {
        let (target_from_source, verdict, confidence, score) = match outcome {
            Err(failure) => (None, Verdict::Failed(failure), 0.0, None),
            Ok(Answer { hypothesis, significance }) => {
                let verdict = significance.check(&self.config.verdict).map_or_else(Verdict::Failed, |()| Verdict::Ok);
                let pose = self.in_file_coordinates(&hypothesis.target_from_source);
                (Some(pose), verdict, significance.confidence(&self.config.verdict), Some(hypothesis.score.value()))
            }
        };
        Registration {
            target_from_source,
            verdict,
            confidence,
            score,
            counts: self.counts,
            raw_resolution: self.raw_resolution,
            resolution: self.resolution,
            timings: self.clock.times,
        }
    }

    fn in_file_coordinates(&self, pose: &RigidTransform) -> RigidTransform {
        uncentred(pose, self.scans.source.origin(), self.scans.target.origin())
    }
}
