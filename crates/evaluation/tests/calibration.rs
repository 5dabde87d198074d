//! The answer derived from a row is the one that the program gives.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_evaluation::calibration::{AttemptRow, CalibrationRow, Origin};
use congruent_geometry::{RawScan, Scan};
use congruent_pipeline::{PipelineConfig, Verdict, VerdictConfig, register, register_tried};
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::VirtualScanner;
use congruent_simulation::shapes;

fn look(seed: u64, view_angle_deg: f64) -> (RawScan, RawScan) {
    let view_angle = view_angle_deg.to_radians();
    let pair = figurine_pair(&PairOptions { seed, view_angle, pixels: 150, ..PairOptions::default() });
    (pair.source, pair.target)
}

/// Two scans of a box, whose six sides look alike.
fn boxes() -> (RawScan, RawScan) {
    let cuboid = shapes::cuboid([4.0, 3.0, 2.0]);
    let scan = |azimuth| VirtualScanner::orbit(&cuboid, azimuth, 0.5, 3.0, 150).scan(&cuboid, 1).cloud();
    (scan(0.6), scan(0.9))
}

#[test]
fn a_row_answers_as_the_program_does() {
    let config = PipelineConfig::default();
    let VerdictConfig::Dense(verdict) = &config.verdict else { panic!("the default looks at the surfaces") };
    let other_object = (look(1, 40.0).0, look(9, 40.0).1);
    let pairs =
        [("easy", look(1, 40.0)), ("hardly any overlap", look(1, 150.0)), ("other", other_object), ("box", boxes())];
    let mut verdicts = Vec::new();
    for (name, (source, target)) in pairs {
        let (source, target) = (Scan::new(&source).unwrap(), Scan::new(&target).unwrap());
        let found = register(&source, &target, &config);
        let tried = register_tried(&source, &target, &config, 0.9999);
        let attempts = tried.iter().filter_map(|tried| AttemptRow::new(tried, None)).collect();
        let row =
            CalibrationRow { id: name.to_owned(), groups: vec![name.to_owned()], origin: Origin::Simulated, attempts };
        let answer = row.answer(&verdict.calibration, verdict);
        assert_eq!(answer.is_ok, found.verdict() == Verdict::Ok, "{name}");
        assert_eq!(answer.known, found.fit().map(|fit| fit.predictors), "{name}");
        if found.alternatives().is_empty() {
            assert_eq!(answer.confidence, found.confidence(), "{name}");
        }
        verdicts.push(found.verdict());
    }
    assert!(verdicts[0] == Verdict::Ok && verdicts[2] == Verdict::Failed, "{verdicts:?}");
}
