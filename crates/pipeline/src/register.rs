//! From two scans to one pose: attempts of increasing effort, until one is accepted.

use crate::chain::{Answer, Chain, Proposals};
use crate::memory::Memory;
use crate::prior::Bounds;
use crate::ranking::Ranked;
use crate::stage::Clock;
use crate::{
    Alternative, Counts, EscalationStep, Estimate, Failure, Outcome, Pair, PipelineConfig, Predictors, Prior,
    RankingConfig, Registration, SamplingConfig, Settings, Signs, Stage, Trace,
};
use congruent_geometry::{Oriented, RigidTransform, Scan, uncentred};
use congruent_refinement::Uncertainty;
use nalgebra::Vector3;
use std::convert::Infallible;

/// Registers two scans.
///
/// The result is the same, bit for bit, on any number of threads; the work runs on rayon's current thread pool. If a
/// pair cannot be registered, the outcome contains the reason.
///
/// ```
/// use congruent_geometry::Scan;
/// use congruent_pipeline::{Outcome, PipelineConfig, register};
/// use congruent_simulation::pair::{PairOptions, figurine_pair};
///
/// // Two looks at a figurine; `congruent_io::read_scan` reads yours.
/// let pair = figurine_pair(&PairOptions::default());
/// let (source, target) = (Scan::new(&pair.source)?, Scan::new(&pair.target)?);
/// let found = register(&source, &target, &PipelineConfig::default());
/// match &found.outcome {
///     Outcome::Ok(estimate) => println!("{}", estimate.target_from_source),
///     Outcome::Ambiguous(_, others) => println!("{} other poses fit nearly as well", others.len()),
///     Outcome::Failed(reason, _) => println!("not registered: {reason}"),
/// }
/// assert!(matches!(found.outcome, Outcome::Ok(_)));
/// # Ok::<(), congruent_geometry::ScanError>(())
/// ```
#[must_use]
pub fn register(source: &Scan, target: &Scan, config: &PipelineConfig) -> Registration {
    register_within(source, target, &Prior::default(), config)
}

/// Registers two scans whose pose is partly known.
///
/// Poses that the prior excludes are discarded as soon as they are proposed, and are never returned; the prior's guess,
/// refined and as it is, competes with the others.
#[must_use]
pub fn register_within(source: &Scan, target: &Scan, prior: &Prior, config: &PipelineConfig) -> Registration {
    register_traced(Pair { source, target }, prior, config, &|_| ()).0
}

/// Registers two scans as [`register_within`] does, and also returns what the stages of the deciding attempt produced.
///
/// `observe` is called with each stage as it begins.
#[must_use]
pub fn register_traced(
    scans: Pair<&Scan>,
    prior: &Prior,
    config: &PipelineConfig,
    observe: &dyn Fn(Stage),
) -> (Registration, Trace) {
    let mut clock = Clock::new(observe);
    let mut memory = Memory::default();
    let Ok(mut best) = escalated(config, &mut clock, |config, signs, clock| {
        Ok::<_, Infallible>(attempt(&scans, prior, Proposals::Searched, config, signs, &mut memory, clock))
    });
    let trace = std::mem::take(&mut best.trace);
    (best.registration(&scans.map(|scan| *scan.origin()), clock), trace)
}

/// Returns the first attempt whose pose is accepted or ambiguous, or else the one with the highest confidence. If the
/// side of the normals is uncertain, the other side is tried before a pose is accepted: with normals on the wrong side,
/// a wrong pose may fit well.
pub(crate) fn escalated<E>(
    config: &PipelineConfig,
    clock: &mut Clock<'_>,
    mut attempt: impl FnMut(&PipelineConfig, Signs, &mut Clock<'_>) -> Result<Option<Attempt>, E>,
) -> Result<Attempt, E> {
    let mut best: Option<Attempt> = None;
    for (config, signs) in config.attempts() {
        if best.as_ref().is_some_and(Attempt::is_believed) {
            break;
        }
        if let Some(another) = attempt(&config, signs, clock)? {
            best = Some(match best {
                Some(best) => best.or(another),
                None => another,
            });
        }
    }
    let best = best.expect("an attempt with the signs as they are is made");
    if !best.is_believed() || best.settings.signs == Signs::Other {
        return Ok(best);
    }
    let other = attempt(&best.settings.config, Signs::Other, clock)?;
    Ok(match other {
        Some(other) => best.or(other),
        None => best,
    })
}

/// The result of one attempt.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The pose that it chose, between file coordinates.
    pub target_from_source: RigidTransform,
    /// The measurements of that pose; `None` without a dense ranking.
    pub predictors: Option<Predictors>,
    /// Whether the surfaces hold the pose in all directions.
    pub is_held: bool,
    /// The measurements of substantially different poses that come close to it; empty unless the pose by itself would
    /// be accepted.
    pub close: Vec<Predictors>,
}

/// Registers two scans and returns all attempts that yield a pose, in their order; none follows an attempt whose
/// confidence is at least `enough`.
///
/// [`register`] stops once an attempt is accepted. This function shows what it would return if it accepted other
/// attempts.
#[must_use]
pub fn register_tried(source: &Scan, target: &Scan, config: &PipelineConfig, enough: f64) -> Vec<Tried> {
    let scans = Pair { source, target };
    let origins = scans.map(|scan| *scan.origin());
    let prior = Prior::default();
    let (mut clock, mut memory) = (Clock::new(&|_| ()), Memory::default());
    let mut tried = Vec::new();
    for (changed, signs) in config.attempts() {
        let made = attempt(&scans, &prior, Proposals::Searched, &changed, signs, &mut memory, &mut clock);
        let Some(Attempt { outcome: Ok(answer), .. }) = made else { continue };
        tried.push(Tried {
            target_from_source: uncentred(&answer.target_from_source, &origins.source, &origins.target),
            predictors: answer.judgement.predictors,
            is_held: answer.hold.n_free(config.verdict.min_stiffness()) == 0,
            close: answer.judgement.examined,
        });
        if answer.judgement.confidence >= enough {
            break;
        }
    }
    tried
}

/// The result of an attempt, with what the stages produced.
pub(crate) struct Attempt {
    pub(crate) settings: Settings,
    pub(crate) outcome: Result<Answer, Failure>,
    pub(crate) counts: Counts,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
    pub(crate) trace: Trace,
}

/// Runs the chain once; `None` if it would only repeat an earlier run.
pub(crate) fn attempt(
    scans: &Pair<&Scan>,
    prior: &Prior,
    proposals: Proposals,
    config: &PipelineConfig,
    signs: Signs,
    memory: &mut Memory,
    clock: &mut Clock<'_>,
) -> Option<Attempt> {
    let counts = Counts { points: scans.map(|scan| scan.points().len()), ..Counts::default() };
    let mut chain = Chain {
        config,
        prior,
        bounds: Bounds::default(),
        proposals,
        memory,
        clock,
        signs,
        counts,
        raw_resolution: 0.0,
        resolution: 0.0,
    };
    let mut trace = Trace::default();
    let extents = || scans.map(|scan| scan.extent().max());
    let outcome = chain.run(scans, &mut trace)?.map_err(|failure| failure.explained(extents()));
    let Chain { counts, raw_resolution, resolution, .. } = chain;
    let settings = Settings { config: config.clone(), signs };
    Some(Attempt { settings, outcome, counts, raw_resolution, resolution, trace })
}

impl Attempt {
    pub(crate) fn is_believed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|answer| answer.judgement.doubt.is_none())
    }

    fn confidence(&self) -> f64 {
        self.outcome.as_ref().map_or(-1.0, |answer| answer.judgement.confidence)
    }

    /// Returns the attempt with the higher confidence, the first if they are equal.
    pub(crate) fn or(self, other: Attempt) -> Attempt {
        if other.confidence() > self.confidence() { other } else { self }
    }

    pub(crate) fn registration(self, origins: &Pair<Vector3<f64>>, clock: Clock<'_>) -> Registration {
        let outcome = match self.outcome {
            Err(failure) => Outcome::Failed(failure, None),
            Ok(answer) => answer.outcome(origins),
        };
        Registration {
            outcome,
            settings: self.settings,
            counts: self.counts,
            raw_resolution: self.raw_resolution,
            resolution: self.resolution,
            timings: clock.times,
        }
    }
}

impl Answer {
    fn outcome(mut self, origins: &Pair<Vector3<f64>>) -> Outcome {
        if let Some(doubt) = self.judgement.doubt.take() {
            return Outcome::Failed(doubt, Some(self.estimate(origins)));
        }
        let alternative = |rival: &Ranked| Alternative {
            target_from_source: uncentred(&rival.target_from_source, &origins.source, &origins.target),
            score: rival.score.value(),
        };
        let others: Vec<Alternative> = self.judgement.rivals.iter().map(alternative).collect();
        let estimate = self.estimate(origins);
        if others.is_empty() { Outcome::Ok(estimate) } else { Outcome::Ambiguous(estimate, others) }
    }

    /// Converts the answer to file coordinates.
    fn estimate(self, origins: &Pair<Vector3<f64>>) -> Estimate {
        Estimate {
            target_from_source: uncentred(&self.target_from_source, &origins.source, &origins.target),
            confidence: self.judgement.confidence_alone(),
            score: self.score,
            log10_false_alarms: self.significance.log10_false_alarms,
            hold: self.hold,
            views: views(&self.oriented, origins),
            fit: self.fit,
            uncertainty: self.uncertainty.map(|known| placed(known, &origins.target)),
        }
    }
}

impl PipelineConfig {
    /// Returns the settings of all attempts, in their order; a step whose settings equal those of an earlier attempt is
    /// left out.
    pub(crate) fn attempts(&self) -> impl Iterator<Item = (PipelineConfig, Signs)> + '_ {
        let changed = |step: &EscalationStep| (step.applied(self), step.signs);
        let plain = std::iter::once_with(|| (self.clone(), Signs::Kept));
        let mut before = Vec::new();
        self.quick.iter().map(changed).chain(plain).chain(self.escalation.iter().map(changed)).filter(move |attempt| {
            let is_new = !before.contains(attempt);
            before.push(attempt.clone());
            is_new
        })
    }
}

impl EscalationStep {
    pub(crate) fn applied(&self, config: &PipelineConfig) -> PipelineConfig {
        let mut other = config.clone();
        if let Some(poses) = self.poses {
            other.pool.poses = poses;
        }
        if let (SamplingConfig::Budget(budget), Some(max_points)) = (&mut other.sampling, self.max_points) {
            budget.max_points = max_points;
        }
        if let (RankingConfig::Dense(dense), Some(refined)) = (&mut other.ranking, self.refined) {
            dense.refined = refined;
        }
        if let Some(descriptor) = &self.descriptor {
            other.descriptor = descriptor.clone();
        }
        if let Some(estimator) = &self.estimator {
            other.estimator = estimator.clone();
        }
        other
    }
}

/// Converts an uncertainty to file coordinates.
fn placed(uncertainty: Uncertainty, target_origin: &Vector3<f64>) -> Uncertainty {
    Uncertainty { about: uncertainty.about + target_origin, ..uncertainty }
}

/// Converts the viewpoints to file coordinates.
fn views(oriented: &Pair<Oriented>, origins: &Pair<Vector3<f64>>) -> Pair<Oriented> {
    let placed = |oriented: Oriented, origin: Vector3<f64>| Oriented {
        viewpoint: oriented.viewpoint.map(|viewpoint| viewpoint + origin),
        ..oriented
    };
    Pair { source: placed(oriented.source, origins.source), target: placed(oriented.target, origins.target) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{VerdictConfig, VoxelGridConfig};

    fn n_attempts(config: &PipelineConfig) -> usize {
        config.attempts().count()
    }

    #[test]
    fn a_step_that_changes_nothing_is_no_attempt() {
        let default = PipelineConfig::default();
        assert_eq!(n_attempts(&default), default.quick.len() + 1 + default.escalation.len());
        // A grid of fixed cells has no budget of points that could be changed.
        let gridded =
            PipelineConfig { sampling: SamplingConfig::VoxelGrid(VoxelGridConfig::default()), ..default.clone() };
        assert_eq!(n_attempts(&gridded), n_attempts(&default) - 1);
        // Without a ranking no poses are refined, so the quick attempt is the plain one.
        let unranked = PipelineConfig {
            ranking: RankingConfig::None {},
            verdict: VerdictConfig::AContrario(crate::AContrarioConfig::default()),
            ..default.clone()
        };
        assert_eq!(n_attempts(&unranked), n_attempts(&default) - 1);
    }
}
