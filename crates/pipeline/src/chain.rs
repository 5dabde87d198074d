//! One attempt: every stage of the chain once, in order.

use crate::preparation::sample;
use crate::ranking::{Ranked, Ranking};
use crate::stage::Clock;
use crate::verdict::{Evident, Judgement, Significance};
use crate::{
    Agreement, Counts, Failure, Pair, PipelineConfig, PointToPlaneConfig, RankingConfig, RefinementConfig, Signs, Stage,
};
use congruent_descriptors::{Features, LocalFrame};
use congruent_estimators::{Distinctness, Hypothesis, optimise, sample as sample_hypotheses};
use congruent_geometry::{NeighborIndex, Oriented, RigidTransform, Scan, Surface};
use congruent_matching::Correspondence;
use congruent_metrics::{Clouds, Evidence, Metric};
use congruent_refinement::Hold;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Hypotheses that are optimised for each that is kept.
const OPTIMISED_PER_KEPT: usize = 2;

/// What one attempt came to.
pub(crate) struct Answer {
    /// Between the centred clouds.
    pub(crate) target_from_source: RigidTransform,
    /// By the metric.
    pub(crate) score: f64,
    pub(crate) hold: Hold,
    /// How the surfaces lie on each other, where that was looked at.
    pub(crate) agreement: Option<Agreement>,
    /// Decimal logarithm of the number of random poses with so many inliers.
    pub(crate) log10_false_alarms: f64,
    pub(crate) judgement: Judgement,
}

/// A surface and how its normals were oriented.
struct Prepared {
    surfaces: Pair<Surface>,
    oriented: Pair<Oriented>,
}

/// One attempt and what it has noted so far.
pub(crate) struct Chain<'a, 'c> {
    pub(crate) scans: Pair<&'a Scan>,
    pub(crate) config: &'a PipelineConfig,
    pub(crate) signs: Signs,
    pub(crate) clock: &'a mut Clock<'c>,
    pub(crate) counts: Counts,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
}

impl Chain<'_, '_> {
    /// `None` where the attempt would only repeat an earlier one.
    pub(crate) fn run(&mut self) -> Option<Result<Answer, Failure>> {
        let prepared = match self.prepared() {
            Ok(prepared) => prepared?,
            Err(failure) => return Some(Err(failure)),
        };
        Some(self.registered(&prepared))
    }

    fn registered(&mut self, prepared: &Prepared) -> Result<Answer, Failure> {
        let surfaces = &prepared.surfaces;
        let keypoints = self.keypoints(surfaces);
        let features = self.features(surfaces, &keypoints)?;
        let evidence = self.evidence(surfaces, &features)?;
        let pool = self.pool(surfaces, &evidence)?;
        let chosen = self.chosen(prepared, &pool);
        Ok(self.judged(&chosen, surfaces, &evidence))
    }

    fn prepared(&mut self) -> Result<Option<Prepared>, Failure> {
        let (scans, config) = (self.scans, self.config);
        let sampled = self.clock.time(Stage::Sampling, || sample(&scans, &config.sampling, config.normals.source))?;
        self.raw_resolution = sampled.raw_resolution;
        self.resolution = sampled.resolution;
        let resolution = self.resolution;
        let (surfaces, oriented) = self
            .clock
            .time(Stage::Normals, || sampled.clouds.into_map(|cloud| cloud.into_surface(&config.normals, resolution)))
            .unzip();
        self.counts.points = scans.map(|scan| scan.points().len());
        self.counts.sampled = surfaces.map(Surface::len);
        Ok(Prepared { surfaces, oriented }.with_signs(self.signs))
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
        let Pair { source, target } = surfaces;
        let points = |m: &Correspondence| (source.points()[m.source as usize], target.points()[m.target as usize]);
        let normals = |m: &Correspondence| (source.normals()[m.source as usize], target.normals()[m.target as usize]);
        let evidence = Evidence::new(matches.iter().map(points)).with_normals(matches.iter().map(normals).collect());
        Ok(if self.config.estimator.needs_frames() {
            evidence.with_frames(self.frames(surfaces, &matches))
        } else {
            evidence
        })
    }

    /// Local reference frames at both ends of each match, where the surfaces have them.
    fn frames(
        &self,
        surfaces: &Pair<Surface>,
        matches: &[Correspondence],
    ) -> Vec<Option<(Matrix3<f64>, Matrix3<f64>)>> {
        let frames = self.config.frame.build(self.resolution);
        let at = |surface: &Surface, point: u32| -> Option<LocalFrame> { frames.frame(surface, point) };
        let both =
            |m: &Correspondence| Some((at(&surfaces.source, m.source)?.axes, at(&surfaces.target, m.target)?.axes));
        matches.par_iter().map(both).collect()
    }

    /// The best poses by the metric that are really different, optimised. At least one.
    fn pool(&mut self, surfaces: &Pair<Surface>, evidence: &Evidence) -> Result<Vec<Hypothesis>, Failure> {
        let (config, resolution) = (self.config, self.resolution);
        let metric = config.metric.build(resolution, clouds(surfaces));
        let (pool, trials) = self.clock.time(Stage::Estimation, || {
            let generator = config.estimator.build(evidence, resolution, config.seed);
            let trials = generator.trials();
            let n = config.pool.poses;
            if n <= 1 {
                let best = sample_hypotheses(generator.as_ref(), metric.as_ref(), evidence, 1);
                return (optimised(best, metric.as_ref(), evidence, config.pool.optimisation_rounds), trials);
            }
            let all = sample_hypotheses(generator.as_ref(), metric.as_ref(), evidence, usize::MAX);
            let distinctness = Distinctness::new(surfaces.source.points(), config.pool.distinct.resolve(resolution));
            let promising = distinctness.distinct(&all, OPTIMISED_PER_KEPT * n);
            let better = optimised(promising, metric.as_ref(), evidence, config.pool.optimisation_rounds);
            (distinctness.distinct(&better, n), trials)
        });
        self.counts.trials = trials;
        self.counts.poses = pool.len();
        if pool.is_empty() { Err(Failure::NoHypothesis) } else { Ok(pool) }
    }

    /// The pose that the surfaces prefer, refined.
    fn chosen(&mut self, prepared: &Prepared, pool: &[Hypothesis]) -> Chosen {
        let RankingConfig::Dense(dense) = &self.config.ranking else {
            let pose = pool[0].target_from_source;
            return Chosen {
                target_from_source: self.refined(&prepared.surfaces, &pose),
                ranked: None,
                others: Vec::new(),
            };
        };
        let resolution = self.resolution;
        let viewpoints = prepared.trusted_viewpoints();
        let poses: Vec<RigidTransform> = pool.iter().map(|h| h.target_from_source).collect();
        let (ranking, ranked) = self.clock.time(Stage::Ranking, || {
            let ranking = Ranking::new(&prepared.surfaces, &viewpoints, dense, resolution);
            let ranked = ranking.rank(&poses);
            (ranking, ranked)
        });
        let best = ranked[0];
        let refined = self.refined(&prepared.surfaces, &best.target_from_source);
        let again = ranking.judge(&refined);
        let kept = if again.score >= best.score { again } else { best };
        Chosen {
            target_from_source: kept.target_from_source,
            ranked: Some(kept),
            others: ranking.others(&kept, &ranked),
        }
    }

    /// The source as it came, on the sampled target.
    fn refined(&mut self, surfaces: &Pair<Surface>, pose: &RigidTransform) -> RigidTransform {
        let RefinementConfig::PointToPlane(config) = &self.config.refinement else { return *pose };
        let icp = config.build(self.resolution);
        self.clock.time(Stage::Refinement, || {
            icp.refine(&surfaces.source, &surfaces.target, surfaces.target.index() as &NeighborIndex, pose)
                .target_from_source
        })
    }

    /// How firmly the surfaces hold the pose where they touch.
    fn hold(&self, surfaces: &Pair<Surface>, pose: &RigidTransform) -> Hold {
        let measure = PointToPlaneConfig::default().build(self.resolution);
        measure.measure(&surfaces.source, &surfaces.target, surfaces.target.index(), pose).hold
    }

    fn judged(&mut self, chosen: &Chosen, surfaces: &Pair<Surface>, evidence: &Evidence) -> Answer {
        let (config, resolution) = (self.config, self.resolution);
        let metric = config.metric.build(resolution, clouds(surfaces));
        let pose = &chosen.target_from_source;
        let threshold = config.verdict.inlier_threshold();
        let trials = self.counts.trials;
        let significance =
            self.clock.time(Stage::Verdict, || Significance::of(pose, evidence, threshold.resolve(resolution), trials));
        self.counts.inliers = significance.inliers;
        let evidence_of = Evident { chosen, significance: &significance, hold: self.hold(surfaces, pose), resolution };
        let judgement = config.verdict.judge(&evidence_of);
        Answer {
            target_from_source: *pose,
            score: metric.score(evidence, pose).value(),
            hold: evidence_of.hold,
            agreement: chosen.ranked.map(|ranked| Agreement::new(&ranked, resolution)),
            log10_false_alarms: significance.log10_false_alarms,
            judgement,
        }
    }
}

fn clouds(surfaces: &Pair<Surface>) -> Clouds<'_> {
    Clouds { source: &surfaces.source, target: &surfaces.target }
}

/// The pose that an attempt settled on.
pub(crate) struct Chosen {
    target_from_source: RigidTransform,
    pub(crate) ranked: Option<Ranked>,
    /// Really different poses, best first.
    pub(crate) others: Vec<Ranked>,
}

impl Prepared {
    /// With the signs that an attempt asks for; nothing where there is nothing to turn.
    fn with_signs(self, signs: Signs) -> Option<Prepared> {
        match signs {
            Signs::Kept => Some(self),
            Signs::Other if self.oriented.source.sure && self.oriented.target.sure => None,
            Signs::Other => {
                let Prepared { surfaces: Pair { source, target }, oriented } = self;
                // One scan is enough: what counts is whether the two agree.
                let surfaces = if oriented.source.sure {
                    Pair { source, target: target.flipped() }
                } else {
                    Pair { source: source.flipped(), target }
                };
                Some(Prepared { surfaces, oriented })
            }
        }
    }

    fn trusted_viewpoints(&self) -> Pair<Option<Vector3<f64>>> {
        self.oriented.map(|oriented| oriented.viewpoint.filter(|_| oriented.sure))
    }
}

/// Fits each pose to all that agree with it; best first.
fn optimised(hypotheses: Vec<Hypothesis>, metric: &dyn Metric, evidence: &Evidence, rounds: usize) -> Vec<Hypothesis> {
    if rounds == 0 {
        return hypotheses;
    }
    let mut better: Vec<Hypothesis> = hypotheses
        .into_par_iter()
        .map(|h| {
            let (target_from_source, score) = optimise(&h.target_from_source, metric, evidence, rounds);
            Hypothesis { target_from_source, score, ..h }
        })
        .collect();
    better.sort_by(|a, b| b.score.cmp(&a.score).then(a.trial.cmp(&b.trial)));
    better
}
