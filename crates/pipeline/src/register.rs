//! From two scans to one pose: attempts of rising effort, until one is believed.

use crate::chain::{Answer, Chain};
use crate::stage::Clock;
use crate::{
    Counts, EscalationStep, Failure, Pair, PipelineConfig, RankingConfig, Registration, SamplingConfig, Signs, Stage,
    Trace, Verdict,
};
use congruent_geometry::{RigidTransform, Scan, uncentred};

/// Registers two scans.
///
/// `observe` is told each stage as it begins. The result is the same, bit for bit, on any number of threads; it runs
/// on rayon's current pool. A pair that cannot be registered is an answer too, with the reason in its verdict.
#[must_use]
pub fn register(source: &Scan, target: &Scan, config: &PipelineConfig, observe: &dyn Fn(Stage)) -> Registration {
    register_traced(source, target, config, observe).0
}

/// The same, with what the stages of the attempt that gave the answer have left.
#[must_use]
pub fn register_traced(
    source: &Scan,
    target: &Scan,
    config: &PipelineConfig,
    observe: &dyn Fn(Stage),
) -> (Registration, Trace) {
    let scans = Pair { source, target };
    let mut clock = Clock::new(observe);
    let mut best =
        attempt(&scans, config, Signs::Kept, &mut clock).expect("an attempt with the signs as they are is made");
    for step in &config.escalation {
        if best.is_believed() {
            break;
        }
        let harder = step.applied(config);
        if let Some(another) = attempt(&scans, &harder, step.signs, &mut clock) {
            best = best.or(another);
        }
    }
    let trace = std::mem::take(&mut best.trace);
    (best.registration(&scans, clock), trace)
}

/// What an attempt left.
struct Attempt {
    outcome: Result<Answer, Failure>,
    counts: Counts,
    raw_resolution: f64,
    resolution: f64,
    trace: Trace,
}

/// One run of the chain; `None` where it would only repeat an earlier one.
fn attempt(scans: &Pair<&Scan>, config: &PipelineConfig, signs: Signs, clock: &mut Clock<'_>) -> Option<Attempt> {
    let counts = Counts { points: scans.map(|scan| scan.points().len()), ..Counts::default() };
    let mut chain = Chain { scans: *scans, config, signs, clock, counts, raw_resolution: 0.0, resolution: 0.0 };
    let mut trace = Trace::default();
    let outcome = chain.run(&mut trace)?;
    let Chain { counts, raw_resolution, resolution, .. } = chain;
    Some(Attempt { outcome, counts, raw_resolution, resolution, trace })
}

impl Attempt {
    fn is_believed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|answer| answer.judgement.doubt.is_none())
    }

    fn confidence(&self) -> f64 {
        self.outcome.as_ref().map_or(-1.0, |answer| answer.judgement.confidence)
    }

    /// The more believable one; of equals the first.
    fn or(self, other: Attempt) -> Attempt {
        if other.confidence() > self.confidence() { other } else { self }
    }

    fn registration(self, scans: &Pair<&Scan>, clock: Clock<'_>) -> Registration {
        let in_file_coordinates = |pose: &RigidTransform| uncentred(pose, scans.source.origin(), scans.target.origin());
        let (answer, verdict) = match self.outcome {
            Err(failure) => (None, Verdict::Failed(failure)),
            Ok(mut answer) => {
                let verdict = match answer.judgement.doubt.take() {
                    Some(doubt) => Verdict::Failed(doubt),
                    None if answer.judgement.rivals.is_empty() => Verdict::Ok,
                    None => Verdict::Ambiguous,
                };
                (Some(answer), verdict)
            }
        };
        let alternatives = match (&answer, &verdict) {
            (Some(answer), Verdict::Ambiguous) => {
                let rivals = answer.judgement.rivals.iter();
                rivals.map(|rival| (in_file_coordinates(&rival.target_from_source), rival.score.value())).collect()
            }
            _ => Vec::new(),
        };
        Registration {
            target_from_source: answer.as_ref().map(|answer| in_file_coordinates(&answer.target_from_source)),
            verdict,
            alternatives,
            confidence: answer.as_ref().map_or(0.0, |answer| answer.judgement.confidence),
            score: answer.as_ref().map(|answer| answer.score),
            log10_false_alarms: answer.as_ref().map(|answer| answer.log10_false_alarms),
            hold: answer.as_ref().map(|answer| answer.hold),
            agreement: answer.and_then(|answer| answer.agreement),
            counts: self.counts,
            raw_resolution: self.raw_resolution,
            resolution: self.resolution,
            timings: clock.times,
        }
    }
}

impl EscalationStep {
    fn applied(&self, config: &PipelineConfig) -> PipelineConfig {
        let mut harder = config.clone();
        if let Some(poses) = self.poses {
            harder.pool.poses = poses;
        }
        if let (SamplingConfig::Budget(budget), Some(max_points)) = (&mut harder.sampling, self.max_points) {
            budget.max_points = max_points;
        }
        if let (RankingConfig::Dense(dense), Some(refined)) = (&mut harder.ranking, self.refined) {
            dense.refined = refined;
        }
        if let Some(descriptor) = &self.descriptor {
            harder.descriptor = descriptor.clone();
        }
        harder
    }
}
