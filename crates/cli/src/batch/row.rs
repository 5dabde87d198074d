//! The row that is written for a pair; docs/FILES.md explains its fields.

use super::pairs::Job;
use congruent_geometry::{RigidTransform, angle_between, to_rows};
use congruent_pipeline::{Counts, Registration, Verdict};
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

/// One line of `results.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) id: String,
    pub(crate) source: String,
    pub(crate) target: String,
    /// Hash of what the input said about the pair; not in the table.
    pub(super) pair: String,
    pub(super) status: Status,
    pub(crate) verdict: Option<Verdict>,
    pub(super) reason: Option<String>,
    pub(crate) error: Option<String>,
    pub(crate) target_from_source: Option<[[f64; 4]; 4]>,
    /// The other poses of an ambiguous pair, best first; not in the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) alternatives: Vec<[[f64; 4]; 4]>,
    pub(crate) confidence: Option<f64>,
    pub(crate) overlap: Option<f64>,
    pub(super) rotation_error_deg: Option<f64>,
    pub(super) centre_error: Option<f64>,
    pub(super) counts: Option<Counts>,
    pub(super) resolution: Option<f64>,
    pub(super) seed: u64,
    pub(super) configuration: String,
    pub(super) version: String,
    pub(super) timings: BTreeMap<String, f64>,
}

/// How a pair ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Status {
    /// With a verdict, whatever it is.
    Done,
    /// A scan that cannot be used, or an internal error.
    Error,
    /// It took too long and was given up.
    TimedOut,
}

impl Status {
    pub(super) fn name(self) -> &'static str {
        match self {
            Status::Done => "done",
            Status::Error => "error",
            Status::TimedOut => "timed-out",
        }
    }
}

/// A pair, and what it was registered with.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    pub(super) job: &'a Job,
    /// Names of the source and the target.
    pub(super) names: [&'a str; 2],
    pub(super) seed: u64,
    pub(super) configuration: &'a str,
}

/// Why a pair has no verdict.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NoVerdict {
    pub(super) status: Status,
    pub(super) error: String,
}

impl Row {
    /// Returns a row without an outcome.
    fn of(Asked { job, names, seed, configuration }: Asked<'_>, took: Duration) -> Row {
        Row {
            id: job.id.clone(),
            source: names[0].to_owned(),
            target: names[1].to_owned(),
            pair: job.fingerprint(names),
            status: Status::Done,
            verdict: None,
            reason: None,
            error: None,
            target_from_source: None,
            alternatives: Vec::new(),
            confidence: None,
            overlap: None,
            rotation_error_deg: None,
            centre_error: None,
            counts: None,
            resolution: None,
            seed,
            configuration: configuration.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            timings: BTreeMap::from([("total".to_owned(), took.as_secs_f64())]),
        }
    }

    /// Returns the row of a pair that ended without a verdict.
    pub(super) fn failed(asked: Asked<'_>, took: Duration, why: NoVerdict) -> Row {
        Row { status: why.status, error: Some(why.error), ..Row::of(asked, took) }
    }

    /// Returns the row of a pair with a verdict. `centre` is the centre of the source's bounding box.
    pub(super) fn done(asked: Asked<'_>, took: Duration, registration: &Registration, centre: Vector3<f64>) -> Row {
        let mut row = Row::of(asked, took);
        row.timings.extend(registration.timings.iter().map(|t| (t.stage.name().to_owned(), t.time.as_secs_f64())));
        let pose = registration.pose();
        let errors = pose.zip(asked.job.truth.as_ref()).map(|(pose, truth)| errors(pose, truth, centre));
        Row {
            verdict: Some(registration.verdict()),
            reason: registration.reason(),
            target_from_source: pose.map(to_rows),
            alternatives: registration.alternatives().iter().map(|other| to_rows(&other.target_from_source)).collect(),
            confidence: Some(registration.confidence()),
            overlap: registration.fit().map(|fit| fit.agreement.overlap),
            rotation_error_deg: errors.map(|e| e.0),
            centre_error: errors.map(|e| e.1),
            counts: Some(registration.counts),
            resolution: Some(registration.resolution),
            ..row
        }
    }

    /// Returns the message for the progress display.
    pub(super) fn word(&self) -> String {
        let seconds = self.timings.get("total").copied().unwrap_or_default();
        match (&self.verdict, &self.error) {
            (_, Some(error)) => format!("{} {}: {error} ({seconds:.1} s)", self.id, self.status.name()),
            (verdict, None) => format!(
                "{} {} (confidence {:.3}, {seconds:.1} s)",
                self.id,
                verdict.map_or("without a verdict", Verdict::name),
                self.confidence.unwrap_or_default()
            ),
        }
    }
}

/// Returns the rotation error in degrees, and the distance of the source's centre from its true place, data units.
fn errors(pose: &RigidTransform, truth: &RigidTransform, centre: Vector3<f64>) -> (f64, f64) {
    let centre = Point3::from(centre);
    (angle_between(pose, truth).to_degrees(), (pose * centre - truth * centre).norm())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row of a pair that could not be registered.
    pub(in crate::batch) fn broken(id: &str) -> Row {
        let job = Job { id: id.to_owned(), source: 0, target: 1, truth: None, guess: None };
        let asked = Asked { job: &job, names: ["a.ply", "b,c.ply"], seed: 7, configuration: "0f" };
        let why = NoVerdict { status: Status::Error, error: "a.ply: line 3, \"x\"\nis no number".to_owned() };
        Row::failed(asked, Duration::from_millis(1500), why)
    }

    /// A row of a pair with a verdict.
    pub(in crate::batch) fn done(id: &str) -> Row {
        Row { status: Status::Done, error: None, verdict: Some(Verdict::Failed), ..broken(id) }
    }

    #[test]
    fn a_row_survives_json() {
        let row = broken("a--b");
        assert_eq!(serde_json::from_str::<Row>(&serde_json::to_string(&row).unwrap()).unwrap(), row);
    }
}
