//! What a batch records about one pair.

use crate::{GroundTruth, SHARED_WITHIN_PR, inlier_share, repeatability};
use congruent_geometry::{RigidTransform, to_rows};
use congruent_io::csv_line;
use congruent_metrics::Evidence;
use congruent_pipeline::{Registration, Trace, Verdict};
use serde::{Deserialize, Serialize};

/// Keypoints within this distance, in `pr` of the chain, are the same.
const REPEATED_WITHIN_PR: f64 = 2.0;

/// Whether a pair counts in the statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It counts.
    Scored,
    /// The scans share too little surface under the truth; listed but not counted.
    NotEvaluable,
    /// A file could not be used; listed but not counted.
    Error,
}

/// One pair of a batch. Lengths are in data units unless their name ends in `_pr`: `pr` of the errors is the mean
/// resolution of the two scans as provided, `pr` of matches and keypoints is that of the chain (`resolution`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRow {
    /// Name of the data set.
    pub dataset: String,
    /// Name of the source in the data set.
    pub source: String,
    /// Name of the target in the data set.
    pub target: String,
    /// Overlap, as given by the data set or else measured; 0 to 1.
    pub overlap: f64,
    /// Whether it counts.
    pub status: Status,
    /// What was wrong with a file, if anything.
    pub error: Option<String>,
    /// The paper's RMSE; `None` if there is no pose or the pair is not evaluable.
    pub rmse_pr: Option<f64>,
    /// The root mean square error; `None` like `rmse_pr`.
    pub rms_pr: Option<f64>,
    /// Rotation error, degrees; `None` like `rmse_pr`.
    pub rotation_deg: Option<f64>,
    /// Translation error; `None` like `rmse_pr`.
    pub translation: Option<f64>,
    /// The verdict; `None` if a file could not be used.
    pub verdict: Option<Verdict>,
    /// Confidence, 0 to 1; `None` if a file could not be used.
    pub confidence: Option<f64>,
    /// Time from two scans in memory to the answer, seconds.
    pub seconds: f64,
    /// Number of source points on shared surface under the truth.
    pub n_shared: usize,
    /// Mean resolution of the scans as provided.
    pub raw_resolution: f64,
    /// Meaning of `pr` in the chain; zero if sampling failed.
    pub resolution: f64,
    /// Number of correspondences kept.
    pub matches: usize,
    /// Number of true correspondences among these: within 5 pr under the true pose …
    pub inliers_5pr: usize,
    /// … and within 7.5 pr.
    pub inliers_7_5pr: usize,
    /// Fraction of the source keypoints on shared surface that the target has too, within 2 pr; `None` if none are.
    pub repeatability: Option<f64>,
    /// The pose, row by row; file coordinates.
    pub target_from_source: Option<[[f64; 4]; 4]>,
    /// Fingerprint of the configuration and the program's version.
    pub configuration: String,
    /// Fingerprint of the pair and its truth.
    pub pair: String,
}

impl PairRow {
    /// Columns of [`PairRow::csv`].
    pub const COLUMNS: [&str; 23] = [
        "dataset",
        "source",
        "target",
        "overlap",
        "status",
        "rmse_pr",
        "rms_pr",
        "rotation_deg",
        "translation",
        "verdict",
        "confidence",
        "seconds",
        "n_shared",
        "raw_resolution",
        "resolution",
        "matches",
        "inliers_5pr",
        "inlier_ratio_5pr",
        "inliers_7_5pr",
        "inlier_ratio_7_5pr",
        "repeatability",
        "configuration",
        "error",
    ];

    /// Creates a row that contains only the names and the overlap of the pair.
    #[must_use]
    pub fn new(dataset: &str, source: &str, target: &str, overlap: f64) -> Self {
        PairRow {
            dataset: dataset.to_owned(),
            source: source.to_owned(),
            target: target.to_owned(),
            overlap,
            status: Status::Scored,
            error: None,
            rmse_pr: None,
            rms_pr: None,
            rotation_deg: None,
            translation: None,
            verdict: None,
            confidence: None,
            seconds: 0.0,
            n_shared: 0,
            raw_resolution: 0.0,
            resolution: 0.0,
            matches: 0,
            inliers_5pr: 0,
            inliers_7_5pr: 0,
            repeatability: None,
            target_from_source: None,
            configuration: String::new(),
            pair: String::new(),
        }
    }

    /// Returns the row of a pair whose files cannot be used.
    #[must_use]
    pub fn with_error(self, error: String) -> Self {
        PairRow { status: Status::Error, error: Some(error), ..self }
    }

    /// Adds the answer and its errors.
    #[must_use]
    pub fn judged(mut self, truth: &GroundTruth, registration: &Registration, trace: &Trace, seconds: f64) -> Self {
        self.status = if truth.is_evaluable() { Status::Scored } else { Status::NotEvaluable };
        self.verdict = Some(registration.verdict());
        self.confidence = Some(registration.confidence());
        self.seconds = seconds;
        self.n_shared = truth.n_shared();
        self.raw_resolution = truth.resolution();
        self.resolution = registration.resolution;
        self.matches = trace.matches.len();
        self.count_matches(truth.centred(), trace, registration.resolution);
        if let Some(pose) = registration.pose() {
            self.target_from_source = Some(to_rows(pose));
            if let Some(errors) = truth.errors(pose) {
                self.rmse_pr = Some(errors.rmse_pr);
                self.rms_pr = Some(errors.rms_pr);
                self.rotation_deg = Some(errors.rotation_deg);
                self.translation = Some(errors.translation);
            }
        }
        self
    }

    /// Returns whether the RMSE of the pose is below `d_rmse`, in `pr` of the errors. A pair without a pose is wrong.
    #[must_use]
    pub fn is_right(&self, d_rmse: f64) -> bool {
        self.rmse_pr.is_some_and(|rmse| rmse < d_rmse)
    }

    /// Returns one line of CSV, in the order of [`PairRow::COLUMNS`].
    #[must_use]
    pub fn csv(&self) -> String {
        let number = |v: f64| format!("{v:.6}");
        let maybe = |v: Option<f64>| v.map_or(String::new(), number);
        let ratio = |n: usize| number(n as f64 / self.matches.max(1) as f64);
        let status = match self.status {
            Status::Scored => "scored",
            Status::NotEvaluable => "not-evaluable",
            Status::Error => "error",
        };
        csv_line([
            self.dataset.clone(),
            self.source.clone(),
            self.target.clone(),
            number(self.overlap),
            status.to_owned(),
            maybe(self.rmse_pr),
            maybe(self.rms_pr),
            maybe(self.rotation_deg),
            // Data units may be metres or millimetres.
            self.translation.map_or(String::new(), |v| format!("{v:.6e}")),
            self.verdict.map(|verdict| verdict.to_string()).unwrap_or_default(),
            maybe(self.confidence),
            number(self.seconds),
            self.n_shared.to_string(),
            format!("{:.6e}", self.raw_resolution),
            format!("{:.6e}", self.resolution),
            self.matches.to_string(),
            self.inliers_5pr.to_string(),
            ratio(self.inliers_5pr),
            self.inliers_7_5pr.to_string(),
            ratio(self.inliers_7_5pr),
            maybe(self.repeatability),
            self.configuration.clone(),
            self.error.clone().unwrap_or_default(),
        ])
    }

    fn count_matches(&mut self, truth: &RigidTransform, trace: &Trace, resolution: f64) {
        let Some(surfaces) = &trace.surfaces else { return };
        let (source, target) = (surfaces.source.points(), surfaces.target.points());
        let ends = trace.matches.iter().map(|m| (source[m.source as usize], target[m.target as usize]));
        let evidence = Evidence::new(ends);
        self.inliers_5pr = inlier_share(&evidence, truth, 5.0 * resolution).inliers;
        self.inliers_7_5pr = inlier_share(&evidence, truth, 7.5 * resolution).inliers;
        let keypoints = surfaces.as_ref().zip(trace.keypoints.as_ref()).map(|(surface, keypoints)| {
            keypoints.iter().map(|k| surface.points()[k.index as usize]).collect::<Vec<_>>()
        });
        self.repeatability = repeatability(
            &keypoints.source,
            &keypoints.target,
            surfaces.target.index(),
            truth,
            REPEATED_WITHIN_PR * resolution,
            SHARED_WITHIN_PR * resolution,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_every_column_and_an_error_is_quoted() {
        let row = PairRow::new("set", "a.ply", "b.ply", 0.25).with_error("a.ply: no file, no scan".to_owned());
        let line = row.csv();
        assert!(line.starts_with("set,a.ply,b.ply,0.250000,error,,,,"), "{line}");
        assert!(line.ends_with(",\"a.ply: no file, no scan\""), "{line}");
        assert_eq!(line.matches(',').count(), PairRow::COLUMNS.len() - 1 + 1);
    }

    #[test]
    fn a_pose_is_right_strictly_below_the_bound() {
        let row = PairRow { rmse_pr: Some(2.5), ..PairRow::new("", "", "", 0.0) };
        assert!(row.is_right(2.6) && !row.is_right(2.5) && !PairRow::new("", "", "", 0.0).is_right(9.0));
    }
}
