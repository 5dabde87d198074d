//! One attempt: every stage of the chain once, in order.

use crate::memory::{Memory, SampledPair, Search, Setting};
use crate::preparation::sample;
use crate::prepared::PreparedPair;
use crate::prior::Bounds;
use crate::ranking::{Fields, Ranking};
use crate::refining::{GUESS_RADIUS, drawn_in};
use crate::stage::Clock;
use crate::verdict::{Judgement, Significance};
use crate::{
    Counts, DenseConfig, Failure, Fit, Pair, PipelineConfig, Prior, RankingConfig, Signs, Stage, Trace, stages,
};
use congruent_descriptors::Features;
use congruent_estimators::Hypothesis;
use congruent_geometry::{Oriented, RigidTransform, Scan, Surface};
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;
use congruent_metrics::Evidence;
use congruent_refinement::{Hold, Refinement, Uncertainty};
use std::sync::Arc;

/// The result of one attempt.
pub(crate) struct Answer {
    /// Pose between the centred clouds.
    pub(crate) target_from_source: RigidTransform,
    /// Score by the configured metric.
    pub(crate) score: f64,
    pub(crate) hold: Hold,
    /// How accurate the pose is, between the centred clouds.
    pub(crate) uncertainty: Option<Uncertainty>,
    /// How the normals were oriented.
    pub(crate) oriented: Pair<Oriented>,
    /// How well the surfaces fit each other, if the ranking measured it.
    pub(crate) fit: Option<Fit>,
    /// Inliers, and how many random poses would be expected to have as many.
    pub(crate) significance: Significance,
    pub(crate) judgement: Judgement,
}

/// The origin of the hypotheses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Proposals {
    /// From the correspondences, and from the prior's guess if there is one.
    Searched,
    /// Only from the guess.
    Guessed,
}

/// One attempt, with its settings and the counts so far.
pub(crate) struct Chain<'a, 'c> {
    pub(crate) config: &'a PipelineConfig,
    pub(crate) prior: &'a Prior,
    /// The poses that the prior admits, once the scans are sampled.
    pub(crate) bounds: Bounds,
    pub(crate) proposals: Proposals,
    pub(crate) memory: &'a mut Memory,
    pub(crate) clock: &'a mut Clock<'c>,
    pub(crate) signs: Signs,
    pub(crate) counts: Counts,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
}

impl<'a> Chain<'a, '_> {
    /// Runs the attempt; `None` if it would only repeat an earlier one. The results of the stages are left in `trace`.
    pub(crate) fn run(&mut self, scans: &Pair<&Scan>, trace: &mut Trace) -> Option<Result<Answer, Failure>> {
        let prepared = match self.prepared(scans) {
            Ok(prepared) => prepared?,
            Err(failure) => return Some(Err(failure)),
        };
        let outcome = self.registered(&prepared, trace);
        trace.surfaces = Some(prepared.surfaces);
        Some(outcome)
    }

    fn registered(&mut self, prepared: &PreparedPair, trace: &mut Trace) -> Result<Answer, Failure> {
        let (keypoints, features) = self.described(&prepared.surfaces);
        let answer = self.answered(prepared, features.as_ref(), trace);
        (trace.keypoints, trace.features) = (keypoints, features);
        answer
    }

    /// Runs the stages after description.
    pub(crate) fn answered(
        &mut self,
        prepared: &PreparedPair,
        features: Pair<&Features>,
        trace: &mut Trace,
    ) -> Result<Answer, Failure> {
        self.enough_points()?;
        let surfaces = &prepared.surfaces;
        trace.matches = self.matches(features)?;
        let evidence = self.evidence(surfaces, &trace.matches);
        trace.pool = self.pool(surfaces, &evidence)?;
        let fields = self.fields(surfaces);
        let ranking = fields.as_ref().map(|(dense, fields)| self.ranking(dense, prepared, fields));
        let chosen = self.chosen(prepared, &trace.pool, ranking.as_ref());
        let answer = self.judged(&chosen, prepared, &evidence, ranking.as_ref());
        let (Some(ranked), Some(ranking)) = (chosen.ranked, &ranking) else { return Ok(answer) };
        self.memory.note(&self.config.sampling, self.signs, &ranked);
        let other = self.more_believable(&answer, &chosen, prepared, &evidence, ranking);
        let (ranked, answer) = other.unwrap_or((ranked, answer));
        self.sharpened(answer, &ranked, ranking)
    }

    /// Samples the scans, or takes the sample of an earlier attempt, and turns the normals as the attempt asks; `None`
    /// if there are no uncertain signs to turn.
    fn prepared(&mut self, scans: &Pair<&Scan>) -> Result<Option<PreparedPair>, Failure> {
        let known = self.memory.prepared.get(&self.config.sampling);
        let sampled = match known {
            Some(known) => known,
            None => {
                let sampled = self.sampled(scans)?;
                self.memory.prepared.keep(self.config.sampling.clone(), &sampled);
                sampled
            }
        };
        self.raw_resolution = sampled.raw_resolution;
        self.bounds = self.prior.bounds(&scans.map(|scan| *scan.origin()), sampled.raw_resolution);
        self.resolution = sampled.resolution;
        self.counts.strays = sampled.strays;
        self.counts.sampled = sampled.prepared.surfaces.as_ref().map(|surface| surface.len());
        Ok(sampled.prepared.with_signs(self.signs))
    }

    fn sampled(&mut self, scans: &Pair<&Scan>) -> Result<SampledPair, Failure> {
        let config = self.config;
        let sampled = self
            .clock
            .time(Stage::Sampling, || sample(&[scans.source, scans.target], &config.sampling, config.normals.source))?;
        let (raw_resolution, resolution) = (sampled.raw_resolution, sampled.resolution);
        let strays = Pair::of_two(sampled.strays);
        let both = self.clock.time(Stage::Normals, || stages::normals(sampled.clouds, config, resolution));
        let (surfaces, oriented) = Pair::of_two(both).unzip();
        Ok(SampledPair { prepared: PreparedPair { surfaces, oriented }, strays, raw_resolution, resolution })
    }

    fn described(&mut self, surfaces: &Pair<Surface>) -> (Pair<Vec<Keypoint>>, Pair<Features>) {
        let setting = Setting::new(self.config, self.signs);
        let (keypoints, features) = self.memory.described.get(&setting).unwrap_or_else(|| {
            let keypoints = self.keypoints(surfaces);
            let features = self.features(surfaces, &keypoints);
            self.memory.described.keep(setting, &(keypoints.clone(), features.clone()));
            (keypoints, features)
        });
        self.counts.keypoints = keypoints.as_ref().map(|keypoints| keypoints.len());
        self.counts.described = features.as_ref().map(|features| features.len());
        (keypoints, features)
    }

    fn keypoints(&mut self, surfaces: &Pair<Surface>) -> Pair<Vec<Keypoint>> {
        let (config, resolution) = (self.config, self.resolution);
        self.clock
            .time(Stage::Keypoints, || surfaces.as_ref().par_map(|surface| stages::detect(surface, config, resolution)))
    }

    fn features(&mut self, surfaces: &Pair<Surface>, keypoints: &Pair<Vec<Keypoint>>) -> Pair<Features> {
        let (config, resolution) = (self.config, self.resolution);
        self.clock.time(Stage::Description, || {
            surfaces.as_ref().zip(keypoints.as_ref()).par_map(|(surface, keypoints)| {
                let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
                stages::describe(surface, &points, config, resolution)
            })
        })
    }

    fn matches(&mut self, features: Pair<&Features>) -> Result<Vec<Correspondence>, Failure> {
        let found = self.counts.described;
        if found.source.min(found.target) < 3 && self.proposals == Proposals::Searched {
            return Err(Failure::FewKeypoints { found });
        }
        let (config, setting) = (self.config, Setting::new(self.config, self.signs));
        let matches = self.memory.matches.get(&setting).unwrap_or_else(|| {
            let matches =
                self.clock.time(Stage::Matching, || stages::match_features(features.source, features.target, config));
            self.memory.matches.keep(setting, &matches);
            matches
        });
        self.counts.correspondences = matches.len();
        if matches.len() < 3 && self.proposals == Proposals::Searched {
            return Err(Failure::FewMatches { kept: matches.len() });
        }
        Ok(matches)
    }

    fn evidence(&self, surfaces: &Pair<Surface>, matches: &[Correspondence]) -> Evidence {
        stages::evidence(surfaces, matches, self.config, self.resolution)
    }

    /// Returns the best poses by the metric that are substantially different, optimised, and the guess. At least one.
    fn pool(&mut self, surfaces: &Pair<Surface>, evidence: &Evidence) -> Result<Vec<Hypothesis>, Failure> {
        let (config, resolution) = (self.config, self.resolution);
        let (bounds, proposals) = (&self.bounds, self.proposals);
        let search = Search::new(config, self.signs);
        let pool = self.memory.pools.get(&search).unwrap_or_else(|| {
            let pool = self.clock.time(Stage::Estimation, || {
                let pool = match proposals {
                    Proposals::Searched => stages::estimate_within(bounds, surfaces, evidence, config, resolution),
                    Proposals::Guessed => stages::Pool::default(),
                };
                let guessed = guessed(bounds, surfaces, resolution);
                if guessed.is_empty() {
                    return pool;
                }
                stages::with_given(pool, &guessed, surfaces, evidence, config, resolution)
            });
            self.memory.pools.keep(search, &pool);
            pool
        });
        self.counts.trials = pool.trials;
        self.counts.poses = pool.hypotheses.len();
        if pool.hypotheses.is_empty() { Err(self.bounded(Failure::NoHypothesis)) } else { Ok(pool.hypotheses) }
    }

    /// Returns the closest-point fields of the surfaces and the settings of the dense ranking, if there is one.
    /// Attempts with the same sampling share the fields.
    fn fields(&mut self, surfaces: &Pair<Surface>) -> Option<(&'a DenseConfig, Pair<Arc<Fields>>)> {
        let RankingConfig::Dense(dense) = &self.config.ranking else { return None };
        let (resolution, sampling) = (self.resolution, &self.config.sampling);
        let fields = self.memory.fields.get(sampling).unwrap_or_else(|| {
            let new = |surface: &Surface| Arc::new(Fields::new(surface, dense, resolution));
            let fields = self.clock.time(Stage::Ranking, || surfaces.as_ref().par_map(new));
            self.memory.fields.keep(sampling.clone(), &fields);
            fields
        });
        Some((dense, fields))
    }

    fn ranking<'r>(
        &mut self,
        dense: &'r DenseConfig,
        prepared: &'r PreparedPair,
        fields: &'r Pair<Arc<Fields>>,
    ) -> Ranking<'r>
    where
        'a: 'r,
    {
        let (bounds, resolution) = (self.bounds.clone(), self.resolution);
        let viewpoints = prepared.trusted_viewpoints();
        let new = || Ranking::new(&prepared.surfaces, fields, &viewpoints, dense, bounds, resolution);
        self.clock.time(Stage::Ranking, new)
    }

    /// Refines a pose on the whole surfaces; keeps the start if the result is out of bounds. The sampled surfaces
    /// suffice: the centroids of a grid are averages of all points and have less noise than any of them.
    pub(crate) fn refined(&mut self, surfaces: &Pair<Surface>, pose: &RigidTransform, resolution: f64) -> Refinement {
        let refiner = self.config.refinement.build(resolution, self.bounds.freedom());
        let refined = self.clock.time(Stage::Refinement, || refiner.refine(&surfaces.source, &surfaces.target, pose));
        match self.bounds.admitted(&refined.target_from_source) {
            Some(target_from_source) => Refinement { target_from_source, ..refined },
            None => Refinement { target_from_source: *pose, uncertainty: None, ..refined },
        }
    }
}

/// Returns the guess after a coarse refinement, unless that is out of bounds, then the guess as it is; nothing without
/// a guess.
fn guessed(bounds: &Bounds, surfaces: &Pair<Surface>, resolution: f64) -> Vec<RigidTransform> {
    let Some(guess) = bounds.guess() else { return Vec::new() };
    let drawn = drawn_in(surfaces, &guess, GUESS_RADIUS * resolution, bounds.freedom(), resolution);
    bounds.admitted(&drawn).into_iter().chain([guess]).collect()
}
