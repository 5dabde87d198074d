//! `congruent estimate`: a pose from correspondences of any origin.

use super::align::NOT_REGISTERED;
use super::stages::centred;
use super::{Loaded, load};
use crate::args::EstimateArgs;
use crate::{configuration, output, outputs};
use anyhow::{Context, Result, anyhow, bail};
use congruent_geometry::{NeighborIndex, Point, RawScan, Surface, to_rows, uncentred};
use congruent_io::{Place, read_matches, write_file};
use congruent_matching::Correspondence;
use congruent_metrics::Evidence;
use congruent_pipeline::stages::{
    MOST_MATCHES, Prepared, estimate, evidence, evidence_near, prepare, test_against_chance,
};
use congruent_pipeline::{Failure, Pair, PipelineConfig, Verdict};
use congruent_report::pose_rows;
use nalgebra::Vector3;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What `estimate --json` prints: like fields have the same names as in `align --json`, but `resolution` is one number.
#[derive(Serialize)]
struct Report {
    version: &'static str,
    matches: String,
    target_from_source: Option<[[f64; 4]; 4]>,
    verdict: Verdict,
    reason: Option<String>,
    confidence: f64,
    score: Option<f64>,
    log10_false_alarms: Option<f64>,
    counts: Counts,
    /// The length that `pr` stands for, data units.
    resolution: f64,
    seed: u64,
    /// The largest coordinate of the centres of both sides, data units: how exactly the pose is printed depends on it.
    #[serde(skip)]
    reach: f64,
}

#[derive(Default, Serialize)]
struct Counts {
    correspondences: usize,
    trials: u64,
    poses: usize,
    inliers: usize,
}

pub(super) fn run(args: &EstimateArgs) -> Result<ExitCode> {
    let config = configuration::resolve(&args.stage.run)?;
    let scans = [&args.source, &args.target].into_iter().flatten();
    let inputs: Vec<&Path> = scans.chain([&args.matches]).map(PathBuf::as_path).collect();
    outputs::check(&inputs, args.output.as_deref().as_slice())?;
    let scans = match (&args.source, &args.target) {
        (Some(source), Some(target)) => Some(Pair { source, target }.par_map(|path| load(path)).both()?),
        _ => None,
    };
    let raw: Option<[&RawScan; 2]> = scans.as_ref().map(|pair| [&pair.source.raw, &pair.target.raw]);
    let pairs = read_matches(&args.matches, raw)?;
    let named = || args.matches.display().to_string();
    if pairs.len() > MOST_MATCHES {
        bail!("{}: has {} correspondences; keep only the best {MOST_MATCHES}", named(), pairs.len());
    }
    let input = match &scans {
        Some(scans) => Input::on_scans(&pairs, scans, &config, args),
        None => Input::alone(&pairs, &config, args.stage.resolution).with_context(named),
    }?;
    let report = input.report(&args.matches, &config);
    let json = serde_json::to_string_pretty(&report).context("the result cannot be written as JSON")?;
    output::data(&if args.json { json.clone() } else { report.summary() })?;
    if let Some(path) = &args.output {
        write_file(path, format!("{json}\n").as_bytes())?;
    }
    Ok(if report.verdict == Verdict::Ok { ExitCode::SUCCESS } else { ExitCode::from(NOT_REGISTERED) })
}

/// The input of the stage.
struct Input {
    surfaces: Pair<Surface>,
    evidence: Evidence,
    origins: Pair<Vector3<f64>>,
    resolution: f64,
}

impl Input {
    /// Takes correspondences between scans, whose surfaces provide normals, frames and the resolution.
    fn on_scans(
        pairs: &[[Place; 2]],
        scans: &Pair<Loaded>,
        config: &PipelineConfig,
        args: &EstimateArgs,
    ) -> Result<Input> {
        let files = || [&args.source, &args.target].map(|path| path.clone().unwrap_or_default().display().to_string());
        let prepared = prepare(&[&scans.source.scan, &scans.target.scan], config, args.stage.resolution);
        let Prepared { surfaces, resolution, .. } = prepared.with_context(|| files().join(" and "))?;
        let surfaces = Pair::of_two(surfaces);
        let origins = scans.as_ref().map(|loaded| *loaded.scan.origin());
        let centred = centred_pairs(pairs, &origins).with_context(|| args.matches.display().to_string())?;
        let evidence = evidence_near(&surfaces, &centred, config, resolution);
        Ok(Input { surfaces, evidence, origins, resolution })
    }

    /// Takes correspondences without scans: only the matched points are known.
    fn alone(pairs: &[[Place; 2]], config: &PipelineConfig, resolution: Option<f64>) -> Result<Input> {
        let Some(resolution) = resolution else {
            bail!("the length of pr is unknown; give it (--resolution 0.6u), or the scans (--source and --target)");
        };
        if config.estimator.needs_frames() {
            bail!(
                "the configured estimator needs reference frames; give the scans with --source and --target, or \
                 --set estimator=ransac"
            );
        }
        if config.metric.needs_clouds() {
            bail!(
                "the configured metric needs the whole scans; give them with --source and --target, or --set metric=mse"
            );
        }
        let origins = Pair { source: middle(pairs, 0), target: middle(pairs, 1) };
        let centred = centred_pairs(pairs, &origins)?;
        let surface = |side: usize, points: Vec<Point>| {
            let normals = pairs.iter().map(|pair| pair[side].normal.unwrap_or_default()).collect();
            let index = NeighborIndex::new(&points);
            Surface::new(points, normals, index, resolution)
        };
        let (source, target) = centred.into_iter().unzip();
        let surfaces = Pair { source: surface(0, source), target: surface(1, target) };
        let each_with_its_own = |i: u32| Correspondence { source: i, target: i, distance: 0.0, score: 0.0 };
        let matches: Vec<Correspondence> = (0..).take(pairs.len()).map(each_with_its_own).collect();
        let evidence = evidence(&surfaces, &matches, config, resolution);
        Ok(Input { surfaces, evidence, origins, resolution })
    }

    fn report(&self, matches: &Path, config: &PipelineConfig) -> Report {
        let Input { surfaces, evidence, origins, resolution } = self;
        let mut report = Report {
            version: env!("CARGO_PKG_VERSION"),
            matches: matches.display().to_string(),
            target_from_source: None,
            verdict: Verdict::Failed,
            reason: None,
            confidence: 0.0,
            score: None,
            log10_false_alarms: None,
            counts: Counts { correspondences: evidence.len(), ..Counts::default() },
            resolution: *resolution,
            seed: config.seed,
            reach: origins.source.amax().max(origins.target.amax()),
        };
        if evidence.len() < 3 {
            report.reason = Some(Failure::FewMatches { kept: evidence.len() }.to_string());
            return report;
        }
        let pool = estimate(surfaces, evidence, config, *resolution);
        report.counts = Counts { trials: pool.trials, poses: pool.hypotheses.len(), ..report.counts };
        let Some(best) = pool.hypotheses.first() else {
            report.reason = Some(Failure::NoHypothesis.to_string());
            return report;
        };
        let test = test_against_chance(&best.target_from_source, evidence, pool.trials, config, *resolution);
        let pose = uncentred(&best.target_from_source, &origins.source, &origins.target);
        report.target_from_source = Some(to_rows(&pose));
        report.score = Some(best.score.value());
        report.confidence = test.confidence;
        report.log10_false_alarms = Some(test.log10_false_alarms);
        report.counts.inliers = test.inliers;
        report.verdict = if test.doubt.is_none() { Verdict::Ok } else { Verdict::Failed };
        report.reason = test.doubt.map(|doubt| doubt.to_string());
        report
    }
}

impl Report {
    /// Returns a summary for people.
    fn summary(&self) -> String {
        let mut lines = vec![format!("verdict          {} (confidence {:.3})", self.verdict, self.confidence)];
        lines.extend(self.reason.iter().map(|reason| format!("reason           {reason}")));
        let Counts { correspondences, inliers, .. } = self.counts;
        lines.push(format!("correspondences  {correspondences}, {inliers} of them inliers"));
        if let Some(rows) = &self.target_from_source {
            lines.extend(pose_rows(rows, self.resolution, self.reach));
        }
        lines.join("\n")
    }
}

fn centred_pairs(pairs: &[[Place; 2]], origins: &Pair<Vector3<f64>>) -> Result<Vec<(Point, Point)>> {
    let both = |[p, q]: &[Place; 2]| Some((centred(&p.at, &origins.source)?, centred(&q.at, &origins.target)?));
    let too_far = |(i, [p, q]): (usize, &[Place; 2])| {
        anyhow!(
            "correspondence {} (counted from 1), {:?} to {:?}, is too far from the others or from the scan; correct or \
             remove it",
            i + 1,
            p.at,
            q.at
        )
    };
    pairs.iter().enumerate().map(|(i, pair)| both(pair).ok_or_else(|| too_far((i, pair)))).collect()
}

/// Returns the centre of the bounding box of one side of the matches; zero if there are none.
fn middle(pairs: &[[Place; 2]], side: usize) -> Vector3<f64> {
    let mut places = pairs.iter().map(|pair| Vector3::from(pair[side].at));
    let Some(first) = places.next() else { return Vector3::zeros() };
    let (low, high) = places.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    low * 0.5 + high * 0.5
}
