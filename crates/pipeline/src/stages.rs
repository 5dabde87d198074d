//! Each stage of the chain as a separate function, for those who want to examine one, replace it, or feed it with other
//! data.
//!
//! [`register`](crate::register) runs the same functions one after the other. `resolution` is the meaning of `pr` in
//! data units. Scans and surfaces are centred; [`Scan::origin`] leads back to file coordinates.
//!
//! ```
//! use congruent_geometry::Scan;
//! use congruent_pipeline::{Pair, PipelineConfig, stages};
//! use congruent_simulation::pair::{PairOptions, figurine_pair};
//!
//! let pair = figurine_pair(&PairOptions::default());
//! let scans = [Scan::new(&pair.source)?, Scan::new(&pair.target)?];
//! let config = PipelineConfig::default();
//!
//! let prepared = stages::prepare(&[&scans[0], &scans[1]], &config, None)?;
//! let (surfaces, pr) = (Pair::of_two(prepared.surfaces), prepared.resolution);
//! let features = surfaces.as_ref().par_map(|surface| {
//!     let keypoints = stages::detect(surface, &config, pr);
//!     let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
//!     stages::describe(surface, &points, &config, pr)
//! });
//! let matches = stages::match_features(&features.source, &features.target, &config);
//! let evidence = stages::evidence(&surfaces, &matches, &config, pr);
//! let pool = stages::estimate(&surfaces, &evidence, &config, pr);
//! println!("{}, by {} matches", pool.hypotheses[0].target_from_source, matches.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::preparation::{Cloud, Sampled, sample};
use crate::prior::Bounds;
use crate::ranking::{Fields, Ranking};
use crate::verdict::Significance;
use crate::{AContrarioConfig, Agreement, DenseConfig, Failure, Pair, PipelineConfig, VerdictConfig};
use congruent_descriptors::{Features, LocalFrame};
use congruent_estimators::{Distinctness, Hypothesis, optimise_all, sample as sample_hypotheses};
use congruent_geometry::{Oriented, Point, RigidTransform, Scan, Surface};
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;
use congruent_metrics::{Clouds, Evidence, Metric};
use rayon::prelude::*;
use std::sync::Arc;

/// Number of hypotheses that are optimised for each one kept.
const OPTIMISED_PER_KEPT: usize = 2;

/// Maximum number of hypotheses kept during estimation: what memory permits, and far more than there are different
/// ones.
const MOST_HYPOTHESES: usize = 1_000_000;

/// Thinned scans with normals.
pub struct Prepared {
    /// Sampled points with normals, in the order of the scans.
    pub surfaces: Vec<Surface>,
    /// Mean resolution of the scans as provided, without strays that were left out, data units.
    pub raw_resolution: f64,
    /// Meaning of `pr` in the following stages, data units.
    pub resolution: f64,
}

/// Thins scans with one grid and adds normals. The grid and `pr` depend on all scans
/// together, so a scan that is prepared alone has another `pr` than in a pair, unless `resolution` (data units)
/// determines it. `resolution` does not change the grid.
///
/// # Errors
/// The grid leaves too few points of a scan.
///
/// # Panics
/// Without scans.
pub fn prepare(scans: &[&Scan], config: &PipelineConfig, resolution: Option<f64>) -> Result<Prepared, Failure> {
    let Sampled { clouds, raw_resolution, resolution: own, .. } =
        sample(scans, &config.sampling, config.normals.source)?;
    let resolution = resolution.unwrap_or(own);
    let surfaces = normals(clouds, config, resolution).into_iter().map(|(surface, _)| surface).collect();
    Ok(Prepared { surfaces, raw_resolution, resolution })
}

/// Adds normals to sampled clouds.
pub(crate) fn normals(clouds: Vec<Cloud>, config: &PipelineConfig, resolution: f64) -> Vec<(Surface, Oriented)> {
    clouds.into_par_iter().map(|cloud| cloud.into_surface(&config.normals, resolution)).collect()
}

/// Detects keypoints and returns those with enough support.
#[must_use]
pub fn detect(surface: &Surface, config: &PipelineConfig, resolution: f64) -> Vec<Keypoint> {
    let found = config.detector.build(resolution).detect(surface);
    config.support.apply(surface, &found, resolution)
}

/// Describes the surface points with the given indices; those that cannot be described have no row.
#[must_use]
pub fn describe(surface: &Surface, points: &[u32], config: &PipelineConfig, resolution: f64) -> Features {
    config.descriptor.build(resolution).describe(surface, points)
}

/// Maximum number of correspondences: the compatibility graph and the verdict compare all with all, which would take
/// hours and gigabytes for more.
pub const MOST_MATCHES: usize = 50_000;

/// Matches rows of the source with rows of the target, and returns the best [`MOST_MATCHES`], best first.
///
/// # Panics
/// If the rows of the two tables differ in length.
#[must_use]
pub fn match_features(source: &Features, target: &Features, config: &PipelineConfig) -> Vec<Correspondence> {
    let mut matches = config.matcher.build().matches(source, target);
    matches.truncate(MOST_MATCHES);
    matches
}

/// Collects what poses are judged by: the matched points with their normals and, if the estimator needs them, their
/// local reference frames.
#[must_use]
pub fn evidence(
    surfaces: &Pair<Surface>,
    matches: &[Correspondence],
    config: &PipelineConfig,
    resolution: f64,
) -> Evidence {
    let Pair { source, target } = surfaces;
    let points = matches.iter().map(|m| (source.points()[m.source as usize], target.points()[m.target as usize]));
    let ends = matches.iter().map(|m| [m.source, m.target]).collect::<Vec<_>>();
    with_surroundings(Evidence::new(points), surfaces, &ends, config, resolution)
}

/// Like [`evidence`], for pairs of points that need not be points of the surfaces: normals and frames are those of the
/// nearest surface points. All points are centred like the surfaces.
///
/// # Panics
/// If there are pairs, and a surface has no points.
#[must_use]
pub fn evidence_near(
    surfaces: &Pair<Surface>,
    pairs: &[(Point, Point)],
    config: &PipelineConfig,
    resolution: f64,
) -> Evidence {
    let nearest = |surface: &Surface, point| surface.index().nearest(point).expect("a surface with points").index;
    let ends: Vec<_> =
        pairs.par_iter().map(|(p, q)| [nearest(&surfaces.source, p), nearest(&surfaces.target, q)]).collect();
    with_surroundings(Evidence::new(pairs.iter().copied()), surfaces, &ends, config, resolution)
}

/// Adds the normals, and the frames if the estimator needs them, of the surface points at both ends of each pair. Frames
/// whose axes are too uncertain for the estimator are missing.
fn with_surroundings(
    evidence: Evidence,
    surfaces: &Pair<Surface>,
    ends: &[[u32; 2]],
    config: &PipelineConfig,
    resolution: f64,
) -> Evidence {
    let Pair { source, target } = surfaces;
    let normals = ends.iter().map(|[p, q]| (source.normals()[*p as usize], target.normals()[*q as usize]));
    let evidence = evidence.with_normals(normals.collect());
    if !config.estimator.needs_frames() {
        return evidence;
    }
    let frames = config.frame.build(resolution);
    let is_firm = |frame: &LocalFrame| frame.margins.weakest() >= config.estimator.min_frame_margin();
    let at = |surface: &Surface, point: u32| frames.frame(surface, point).filter(is_firm);
    let both = |[p, q]: &[u32; 2]| Some((at(source, *p)?.axes, at(target, *q)?.axes));
    evidence.with_frames(ends.par_iter().map(both).collect())
}

/// The poses that are kept after estimation.
#[derive(Clone, Debug, Default)]
pub struct Pool {
    /// Poses between the centred clouds, best first by the metric. Those from [`estimate`] are substantially different.
    pub hypotheses: Vec<Hypothesis>,
    /// Number of trials, including those that yielded no pose.
    pub trials: u64,
}

/// Proposes poses, scores them by the metric, and keeps the best that are substantially different, locally optimised.
#[must_use]
pub fn estimate(surfaces: &Pair<Surface>, evidence: &Evidence, config: &PipelineConfig, resolution: f64) -> Pool {
    estimate_within(&Bounds::default(), surfaces, evidence, config, resolution)
}

/// Like [`estimate`], for the poses that the bounds admit.
pub(crate) fn estimate_within(
    bounds: &Bounds,
    surfaces: &Pair<Surface>,
    evidence: &Evidence,
    config: &PipelineConfig,
    resolution: f64,
) -> Pool {
    let metric = config.metric.build(resolution, clouds(surfaces));
    let generator = config.estimator.build(evidence, resolution, config.seed);
    let trials = generator.trials();
    let rounds = config.pool.optimisation_rounds;
    let n = config.pool.poses;
    let distinctness = Distinctness::new(surfaces.source.points(), config.pool.distinct.resolve(resolution));
    let optimised = |poses| optimise_all(poses, metric.as_ref(), evidence, rounds, &distinctness);
    if n <= 1 && bounds.are_open() {
        let best = sample_hypotheses(generator.as_ref(), metric.as_ref(), evidence, 1);
        return Pool { hypotheses: optimised(best), trials };
    }
    let admitted = |hypotheses: Vec<Hypothesis>| admitted(hypotheses, bounds, metric.as_ref(), evidence);
    let all = admitted(sample_hypotheses(generator.as_ref(), metric.as_ref(), evidence, MOST_HYPOTHESES));
    let promising = distinctness.distinct(&all, OPTIMISED_PER_KEPT * n.max(1));
    let better = admitted(optimised(promising));
    Pool { hypotheses: distinctness.distinct(&better, n.max(1)), trials }
}

/// Returns the poses that the bounds admit, made level if the scans are levelled; best first.
fn admitted(hypotheses: Vec<Hypothesis>, bounds: &Bounds, metric: &dyn Metric, evidence: &Evidence) -> Vec<Hypothesis> {
    if bounds.are_open() {
        return hypotheses;
    }
    let scored = |h: &Hypothesis| {
        let target_from_source = bounds.admitted(&h.target_from_source)?;
        Some(Hypothesis { target_from_source, score: metric.score(evidence, &target_from_source), ..*h })
    };
    let mut kept: Vec<Hypothesis> = hypotheses.par_iter().filter_map(scored).collect();
    kept.sort_by(Hypothesis::best_first);
    kept
}

/// Adds poses that were not proposed by correspondences, and sorts best first by the metric; ties go to the poses of
/// the pool, then to the first given.
pub(crate) fn with_given(
    mut pool: Pool,
    given: &[RigidTransform],
    surfaces: &Pair<Surface>,
    evidence: &Evidence,
    config: &PipelineConfig,
    resolution: f64,
) -> Pool {
    let metric = config.metric.build(resolution, clouds(surfaces));
    for (trial, pose) in (pool.trials..).zip(given) {
        let score = metric.score(evidence, pose);
        pool.hypotheses.push(Hypothesis { target_from_source: *pose, score, trial });
    }
    pool.trials += given.len() as u64;
    pool.hypotheses.sort_by(Hypothesis::best_first);
    pool
}

/// Measures how well two surfaces fit each other under a pose between them, as the dense ranking does, but without the
/// positions of the scanners: `occlusion` is zero.
#[must_use]
pub fn agreement(
    surfaces: &Pair<Surface>,
    target_from_source: &RigidTransform,
    config: &DenseConfig,
    resolution: f64,
) -> Agreement {
    let fields = surfaces.as_ref().par_map(|surface| Arc::new(Fields::new(surface, config, resolution)));
    let ranking = Ranking::new(surfaces, &fields, &Pair::default(), config, Bounds::default(), resolution);
    Agreement::new(&ranking.judge(target_from_source), resolution)
}

pub(crate) fn clouds(surfaces: &Pair<Surface>) -> Clouds<'_> {
    Clouds { source: &surfaces.source, target: &surfaces.target }
}

/// The result of the a-contrario test of a pose.
#[derive(Clone, Debug)]
pub struct ChanceTest {
    /// Number of correspondences that are inliers of the pose.
    pub inliers: usize,
    /// Decimal logarithm of the expected number of random poses with as many inliers.
    pub log10_false_alarms: f64,
    /// Confidence, 0 to 1; one half at the border.
    pub confidence: f64,
    /// Why the pose is not accepted; `None` if it is.
    pub doubt: Option<Failure>,
}

/// Tests whether a pose, the best of `trials`, has more inliers than chance explains. If the configured verdict is not
/// `a-contrario`, the default settings of that test are used.
#[must_use]
pub fn test_against_chance(
    pose: &RigidTransform,
    evidence: &Evidence,
    trials: u64,
    config: &PipelineConfig,
    resolution: f64,
) -> ChanceTest {
    let test = match &config.verdict {
        VerdictConfig::AContrario(test) => test.clone(),
        VerdictConfig::Dense(_) => AContrarioConfig::default(),
    };
    let significance = Significance::of(pose, evidence, test.inlier_threshold.resolve(resolution), trials);
    let (confidence, doubt) = significance.judge(&test);
    let Significance { inliers, log10_false_alarms, .. } = significance;
    ChanceTest { inliers, log10_false_alarms, confidence, doubt }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_estimators::{EstimatorConfig, OnePointConfig};
    use congruent_simulation::testing::bumpy;

    #[test]
    fn frames_with_uncertain_axes_are_left_out() {
        let surfaces = Pair { source: bumpy(20, 1), target: bumpy(20, 2) };
        let matches: Vec<_> =
            (0..400).map(|i| Correspondence { source: i, target: 399 - i, distance: 0.0, score: 1.0 }).collect();
        let mut counts = Vec::new();
        for min_margin in [0.0, 0.1, 1.0] {
            let estimator = EstimatorConfig::OnePoint(OnePointConfig { min_margin, ..OnePointConfig::default() });
            let config = PipelineConfig { estimator, ..PipelineConfig::default() };
            let evidence = evidence(&surfaces, &matches, &config, 0.4);
            let frames = config.frame.build(0.4);
            let is_firm = |surface: &Surface, point| {
                frames.frame(surface, point).is_some_and(|frame| frame.margins.weakest() >= min_margin)
            };
            for (i, m) in matches.iter().enumerate() {
                let are_firm = is_firm(&surfaces.source, m.source) && is_firm(&surfaces.target, m.target);
                assert_eq!(evidence.frames(i).is_some(), are_firm, "{min_margin}");
            }
            counts.push((0..matches.len()).filter(|&i| evidence.frames(i).is_some()).count());
        }
        assert!(counts[0] > counts[1] && counts[1] > 0 && counts[2] == 0, "{counts:?}");
    }
}
