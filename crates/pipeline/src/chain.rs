//! One attempt: every stage of the chain once, in order.

use crate::preparation::sample;
use crate::ranking::{Ranked, Ranking};
use crate::refining::refined;
use crate::stage::Clock;
use crate::verdict::{Evident, Judgement, Significance};
use crate::{
    Agreement, Counts, Failure, Pair, PipelineConfig, PointToPlaneConfig, RankingConfig, RefinementConfig, Signs,
    Stage, Trace, stages,
};
use congruent_descriptors::Features;
use congruent_estimators::Hypothesis;
use congruent_geometry::{Oriented, Point, RigidTransform, Scan, Surface};
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;
use congruent_metrics::Evidence;
use congruent_refinement::Hold;
use nalgebra::Vector3;

/// What one attempt came to.
pub(crate) struct Answer {
    /// Between the centred clouds.
    pub(crate) target_from_source: RigidTransform,
    /// By the metric.
    pub(crate) score: f64,
    pub(crate) hold: Hold,
    /// How the normals were oriented.
    pub(crate) oriented: Pair<Oriented>,
    /// How the surfaces lie on each other, where that was looked at.
    pub(crate) agreement: Option<Agreement>,
    /// Decimal logarithm of the number of random poses with so many inliers.
    pub(crate) log10_false_alarms: f64,
    pub(crate) judgement: Judgement,
}

/// Surfaces and what they came from.
pub(crate) struct Prepared<'p> {
    pub(crate) surfaces: Pair<Surface>,
    /// How their normals were oriented.
    pub(crate) oriented: Pair<Oriented>,
    /// The scans as they came, centred.
    pub(crate) points: Pair<&'p [Point]>,
}

/// One attempt and what it has noted so far.
pub(crate) struct Chain<'a, 'c> {
    pub(crate) config: &'a PipelineConfig,
    pub(crate) clock: &'a mut Clock<'c>,
    pub(crate) counts: Counts,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
}

impl Chain<'_, '_> {
    /// `None` where the attempt would only repeat an earlier one. What the stages make is left in `trace`.
    pub(crate) fn run(
        &mut self,
        scans: &Pair<&Scan>,
        signs: Signs,
        trace: &mut Trace,
    ) -> Option<Result<Answer, Failure>> {
        let prepared = match self.prepared(scans, signs) {
            Ok(prepared) => prepared?,
            Err(failure) => return Some(Err(failure)),
        };
        let outcome = self.registered(&prepared, trace);
        trace.surfaces = Some(prepared.surfaces);
        Some(outcome)
    }

    fn registered(&mut self, prepared: &Prepared<'_>, trace: &mut Trace) -> Result<Answer, Failure> {
        let surfaces = &prepared.surfaces;
        trace.keypoints = self.keypoints(surfaces);
        trace.features = self.features(surfaces, &trace.keypoints);
        self.answered(prepared, trace)
    }

    /// From descriptors, which are in the trace, to an answer.
    pub(crate) fn answered(&mut self, prepared: &Prepared<'_>, trace: &mut Trace) -> Result<Answer, Failure> {
        let surfaces = &prepared.surfaces;
        trace.matches = self.matches(&trace.features)?;
        let evidence = self.evidence(surfaces, &trace.matches)?;
        trace.pool = self.pool(surfaces, &evidence)?;
        let chosen = self.chosen(prepared, &trace.pool);
        Ok(self.judged(&chosen, prepared, &evidence))
    }

    fn prepared<'p>(&mut self, scans: &Pair<&'p Scan>, signs: Signs) -> Result<Option<Prepared<'p>>, Failure> {
        let config = self.config;
        let sampled = self
            .clock
            .time(Stage::Sampling, || sample(&[scans.source, scans.target], &config.sampling, config.normals.source))?;
        self.raw_resolution = sampled.raw_resolution;
        self.resolution = sampled.resolution;
        let resolution = self.resolution;
        let both = self.clock.time(Stage::Normals, || stages::normals(sampled.clouds, config, resolution));
        let (surfaces, oriented) = Pair::of_two(both).unzip();
        self.counts.points = scans.map(|scan| scan.points().len());
        self.counts.sampled = surfaces.map(Surface::len);
        let points = Pair { source: scans.source.points(), target: scans.target.points() };
        Ok(Prepared { surfaces, oriented, points }.with_signs(signs))
    }

    fn keypoints(&mut self, surfaces: &Pair<Surface>) -> Pair<Vec<Keypoint>> {
        let (config, resolution) = (self.config, self.resolution);
        let keypoints =
            self.clock.time(Stage::Keypoints, || surfaces.map(|surface| stages::detect(surface, config, resolution)));
        self.counts.keypoints = keypoints.map(Vec::len);
        keypoints
    }

    fn features(&mut self, surfaces: &Pair<Surface>, keypoints: &Pair<Vec<Keypoint>>) -> Pair<Features> {
        let (config, resolution) = (self.config, self.resolution);
        let features = self.clock.time(Stage::Description, || {
            surfaces.as_ref().zip(keypoints.as_ref()).map(|(surface, keypoints)| {
                let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
                stages::describe(surface, &points, config, resolution)
            })
        });
        self.counts.described = features.map(Features::len);
        features
    }

    fn matches(&mut self, features: &Pair<Features>) -> Result<Vec<Correspondence>, Failure> {
        let fewest = self.counts.described.source.min(self.counts.described.target);
        if fewest < 3 {
            return Err(Failure::FewKeypoints { found: fewest });
        }
        let config = self.config;
        let matches = self.clock.time(Stage::Matching, || stages::match_features(features, config));
        self.counts.correspondences = matches.len();
        Ok(matches)
    }

    fn evidence(&self, surfaces: &Pair<Surface>, matches: &[Correspondence]) -> Result<Evidence, Failure> {
        if matches.len() < 3 {
            return Err(Failure::FewMatches { kept: matches.len() });
        }
        Ok(stages::evidence(surfaces, matches, self.config, self.resolution))
    }

    /// The best poses by the metric that are really different, optimised. At least one.
    fn pool(&mut self, surfaces: &Pair<Surface>, evidence: &Evidence) -> Result<Vec<Hypothesis>, Failure> {
        let (config, resolution) = (self.config, self.resolution);
        let pool = self.clock.time(Stage::Estimation, || stages::estimate(surfaces, evidence, config, resolution));
        self.counts.trials = pool.trials;
        self.counts.poses = pool.hypotheses.len();
        if pool.hypotheses.is_empty() { Err(Failure::NoHypothesis) } else { Ok(pool.hypotheses) }
    }

    /// The pose that the surfaces prefer, refined.
    fn chosen(&mut self, prepared: &Prepared<'_>, pool: &[Hypothesis]) -> Chosen {
        let RankingConfig::Dense(dense) = &self.config.ranking else {
            let pose = pool[0].target_from_source;
            return Chosen { target_from_source: self.refined(prepared, &pose), ranked: None, others: Vec::new() };
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
        let refined = self.refined(prepared, &best.target_from_source);
        let kept = ranking.judge(&refined);
        Chosen {
            target_from_source: kept.target_from_source,
            ranked: Some(kept),
            others: ranking.others(&kept, &ranked),
        }
    }

    /// The scans as they came, on each other.
    fn refined(&mut self, prepared: &Prepared<'_>, pose: &RigidTransform) -> RigidTransform {
        let RefinementConfig::PointToPlane(config) = &self.config.refinement else { return *pose };
        let resolution = self.resolution;
        self.clock.time(Stage::Refinement, || refined(&prepared.points, &prepared.surfaces, config, resolution, pose))
    }

    /// How firmly the surfaces hold the pose where they touch.
    fn hold(&self, surfaces: &Pair<Surface>, pose: &RigidTransform) -> Hold {
        let measure = PointToPlaneConfig::default().build(self.resolution);
        measure.measure(&surfaces.source, &surfaces.target, surfaces.target.index(), pose).hold
    }

    fn judged(&mut self, chosen: &Chosen, prepared: &Prepared<'_>, evidence: &Evidence) -> Answer {
        let surfaces = &prepared.surfaces;
        let (config, resolution) = (self.config, self.resolution);
        let metric = config.metric.build(resolution, stages::clouds(surfaces));
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
            oriented: prepared.oriented,
            agreement: chosen.ranked.map(|ranked| Agreement::new(&ranked, resolution)),
            log10_false_alarms: significance.log10_false_alarms,
            judgement,
        }
    }
}

/// The pose that an attempt settled on.
pub(crate) struct Chosen {
    target_from_source: RigidTransform,
    pub(crate) ranked: Option<Ranked>,
    /// Really different poses, best first.
    pub(crate) others: Vec<Ranked>,
}

impl Prepared<'_> {
    /// With the signs that an attempt asks for; nothing where there is nothing to turn.
    fn with_signs(self, signs: Signs) -> Option<Self> {
        let turned = signs.turned(&self.oriented)?;
        let turn = |(surface, turned): (Surface, bool)| if turned { surface.flipped() } else { surface };
        Some(Prepared { surfaces: self.surfaces.zip(turned).into_map(turn), ..self })
    }

    fn trusted_viewpoints(&self) -> Pair<Option<Vector3<f64>>> {
        self.oriented.map(|oriented| oriented.viewpoint.filter(|_| oriented.sure))
    }
}

impl Signs {
    /// On which scan the normals are turned; nothing where there is nothing to turn.
    pub(crate) fn turned(self, oriented: &Pair<Oriented>) -> Option<Pair<bool>> {
        match self {
            Signs::Kept => Some(Pair { source: false, target: false }),
            Signs::Other if oriented.source.sure && oriented.target.sure => None,
            // One scan is enough: what counts is whether the two agree.
            Signs::Other => Some(Pair { source: !oriented.source.sure, target: oriented.source.sure }),
        }
    }
}
