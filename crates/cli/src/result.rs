//! A registration as JSON and as a summary for people.

use crate::reasons::Reasons;
use congruent_geometry::{Length, Oriented, to_rows};
use congruent_pipeline::{Agreement, Counts, Pair, PipelineConfig, Registration, Settings, Signs, Verdict};
use congruent_report::{digits, pose_rows};
use congruent_settings::all_settings;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

/// What `align --json` prints. All lengths are in data units, all times in seconds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    version: &'static str,
    source: String,
    target: String,
    /// Row-major; maps source coordinates into the target's frame.
    target_from_source: Option<[[f64; 4]; 4]>,
    verdict: Verdict,
    reason: Option<String>,
    /// If the verdict is ambiguous, the other poses, best first.
    alternatives: Vec<Alternative>,
    confidence: f64,
    score: Option<f64>,
    /// Decimal logarithm of the number of random poses that would have as many inliers.
    log10_false_alarms: Option<f64>,
    /// The viewpoints from which the scans were assumed to be seen: source, target.
    views: Option<Pair<View>>,
    /// Mean squared separation of the surfaces for a unit motion in each of six independent directions, ascending;
    /// small values belong to directions in which the surfaces slide along each other. Null for a motion that
    /// `--yaw-only` forbids.
    stiffness: Option<[f64; 6]>,
    /// The stiffness that a plane would appear to have because its normals are noisy.
    stiffness_noise: Option<f64>,
    /// How accurate the pose is, if it was refined.
    uncertainty: Option<Uncertainty>,
    /// How well the two surfaces fit under the pose.
    agreement: Option<Agreement>,
    /// Evidence for and against the answer, if the surfaces were compared.
    reasons: Option<Reasons>,
    counts: Counts,
    /// Mean distance between neighbouring points of the scans as read, and the length that `pr` stands for after sampling.
    resolution: Resolution,
    /// The attempt that produced the answer.
    attempt: Attempt,
    /// All lengths in the settings of that attempt, in data units.
    lengths: BTreeMap<String, f64>,
    seed: u64,
    timings: BTreeMap<&'static str, f64>,
}

/// How an attempt differed from the configuration.
#[derive(Debug, Serialize)]
struct Attempt {
    /// Settings that were different, as TOML, by name.
    changed: BTreeMap<String, String>,
    /// Signs of the normals.
    signs: Signs,
}

impl Attempt {
    fn of(settings: &Settings, config: &PipelineConfig) -> Attempt {
        let [all, given] = [&settings.config, config].map(|config| all_settings(config).unwrap_or_default());
        let changed = all.into_iter().filter(|(name, value)| given.get(name) != Some(value)).collect();
        Attempt { changed, signs: settings.signs }
    }
}

/// The true pose is the answer followed by a small motion about a point: a rotation vector (radians), then a translation
/// (data units), along the axes of the target.
#[derive(Debug, Serialize)]
struct Uncertainty {
    /// Covariance of the motion, row by row; zero along the free directions.
    covariance: [[f64; 6]; 6],
    /// The point: the centroid of the overlap, file coordinates of the target.
    about: [f64; 3],
    /// Standard deviation about the least certain axis, degrees.
    rotation_deg: f64,
    /// Standard deviation of that point along the least certain direction, data units.
    translation: f64,
    /// Unit motions that the surfaces do not constrain.
    free_directions: Vec<[f64; 6]>,
}

impl From<&congruent_refinement::Uncertainty> for Uncertainty {
    fn from(known: &congruent_refinement::Uncertainty) -> Self {
        Uncertainty {
            covariance: std::array::from_fn(|row| std::array::from_fn(|column| known.covariance[(row, column)])),
            about: known.about.into(),
            rotation_deg: known.rotation().to_degrees(),
            translation: known.translation(),
            free_directions: known.free_directions.iter().map(|motion| (*motion).into()).collect(),
        }
    }
}

#[derive(Debug, Serialize)]
struct View {
    /// File coordinates; null if no single viewpoint explains the scan.
    viewpoint: Option<[f64; 3]>,
    /// Whether the side to which the normals point is certain.
    sure: bool,
}

impl From<Oriented> for View {
    fn from(oriented: Oriented) -> Self {
        View { viewpoint: oriented.viewpoint.map(Into::into), sure: oriented.sure }
    }
}

#[derive(Debug, Serialize)]
struct Alternative {
    target_from_source: [[f64; 4]; 4],
    score: f64,
}

impl From<&congruent_pipeline::Alternative> for Alternative {
    fn from(other: &congruent_pipeline::Alternative) -> Self {
        Alternative { target_from_source: to_rows(&other.target_from_source), score: other.score }
    }
}

#[derive(Debug, Serialize)]
struct Resolution {
    raw: f64,
    sampled: f64,
}

impl Report {
    pub(crate) fn new(
        files: Pair<&Path>,
        config: &PipelineConfig,
        registration: &Registration,
        reading: Duration,
        total: Duration,
    ) -> Self {
        let mut timings: BTreeMap<_, _> =
            registration.timings.iter().map(|t| (t.stage.name(), t.time.as_secs_f64())).collect();
        timings.insert("reading", reading.as_secs_f64());
        timings.insert("total", total.as_secs_f64());
        let found = registration.estimate();
        Report {
            version: env!("CARGO_PKG_VERSION"),
            source: files.source.display().to_string(),
            target: files.target.display().to_string(),
            target_from_source: registration.pose().map(to_rows),
            verdict: registration.verdict(),
            reason: registration.reason(),
            alternatives: registration.alternatives().iter().map(Alternative::from).collect(),
            confidence: registration.confidence(),
            score: found.map(|found| found.score),
            log10_false_alarms: found.map(|found| found.log10_false_alarms),
            views: found.map(|found| found.views.map(View::from)),
            stiffness: found.map(|found| found.hold.stiffness),
            stiffness_noise: found.map(|found| found.hold.noise),
            uncertainty: registration.uncertainty().map(Uncertainty::from),
            agreement: registration.fit().map(|fit| fit.agreement),
            reasons: Reasons::of(registration),
            counts: registration.counts,
            resolution: Resolution { raw: registration.raw_resolution, sampled: registration.resolution },
            attempt: Attempt::of(&registration.settings, config),
            lengths: resolved_lengths(registration),
            seed: config.seed,
            timings,
        }
    }

    pub(crate) fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers, strings and lists can be written as JSON")
    }

    /// Returns a summary for people.
    pub(crate) fn summary(&self) -> String {
        let mut text = String::new();
        let mut line =
            |label: &str, value: String| writeln!(text, "{label:>16}  {value}").expect("a string can be written to");
        line("verdict", format!("{} (confidence {:.3})", self.verdict, self.confidence));
        if let Some(reason) = &self.reason {
            line("reason", reason.clone());
        }
        let c = &self.counts;
        let both = |counts: Pair<usize>| format!("{} and {}", counts.source, counts.target);
        let strays = match c.strays {
            Pair { source: 0, target: 0 } => String::new(),
            some => format!(", of which {} strays were removed", both(some)),
        };
        line("points", format!("{}{strays}, sampled to {}", both(c.points), both(c.sampled)));
        line("keypoints", format!("{} described", both(c.described)));
        line(
            "correspondences",
            format!("{}, {} of them inliers; {} poses examined", c.correspondences, c.inliers, c.poses),
        );
        if let Some(reasons) = &self.reasons {
            for (label, phrases) in [("for it", &reasons.pro), ("against it", &reasons.against)] {
                let first = phrases.first().map_or("nothing", String::as_str);
                line(label, first.to_owned());
                phrases.iter().skip(1).for_each(|phrase| line("", phrase.clone()));
            }
        }
        if let Some(known) = &self.uncertainty {
            let but = match known.free_directions.len() {
                0 => String::new(),
                n => format!(", except in {n} of 6 directions that the surfaces do not constrain"),
            };
            line(
                "uncertainty",
                format!("good to {:.2}° and {} data units (1σ){but}", known.rotation_deg, digits(known.translation, 2)),
            );
        }
        line(
            "resolution",
            format!(
                "{} as scanned, {} working length (data units)",
                digits(self.resolution.raw, 4),
                digits(self.resolution.sampled, 4)
            ),
        );
        let stages: Vec<String> =
            self.timings.iter().filter(|t| *t.0 != "total").map(|(stage, s)| format!("{stage} {s:.2}")).collect();
        line("time", format!("{:.2} s ({})", self.timings["total"], stages.join(", ")));
        match &self.target_from_source {
            None => line("pose", "none".to_owned()),
            Some(rows) => {
                let about = self.uncertainty.as_ref().map_or([0.0; 3], |known| known.about);
                let reach = about.iter().fold(0.0, |reach: f64, v| reach.max(v.abs()));
                for (i, row) in pose_rows(rows, self.resolution.raw, reach).into_iter().enumerate() {
                    line(if i == 0 { "target_from_source" } else { "" }, row);
                }
            }
        }
        text.trim_end().to_owned()
    }
}

/// Returns all lengths in the settings of the attempt that produced the answer, by their keys, in data units. Those of
/// `sampling` refer to the resolution of the scans as read.
fn resolved_lengths(registration: &Registration) -> BTreeMap<String, f64> {
    let length = |(key, text): (String, String)| {
        let length: Length = text.trim_matches('"').parse().ok()?;
        let pr = if key.starts_with("sampling.") { registration.raw_resolution } else { registration.resolution };
        Some((key, length.resolve(pr)))
    };
    all_settings(&registration.settings.config).unwrap_or_default().into_iter().filter_map(length).collect()
}
