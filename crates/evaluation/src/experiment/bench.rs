//! The stages of one pair up to the matches, each run once for all that need its result.

use super::{MeasuredOn, Nuisance, Problem};
use crate::GroundTruth;
use congruent_descriptors::Features;
use congruent_geometry::{Length, RawScan, RigidTransform, Scan, Surface};
use congruent_matching::Correspondence;
use congruent_pipeline::stages::{self, Prepared};
use congruent_pipeline::{NormalSource, Pair, PipelineConfig, SamplingConfig};
use std::rc::Rc;

/// Two scans, their truth, and the results of stages so far.
pub(super) struct Bench<'a> {
    scans: Pair<&'a RawScan>,
    clean: Pair<Scan>,
    truth: RigidTransform,
    /// Measures errors on the scans as provided.
    judge: Rc<GroundTruth>,
    unspoilt: Shelf<PipelineConfig, Unspoilt>,
    grounds: Shelf<(PipelineConfig, Nuisance), Ground>,
    features: Shelf<(PipelineConfig, Side), Features>,
    matches: Shelf<(PipelineConfig, Nuisance), Vec<Correspondence>>,
}

/// The pair without nuisances, prepared.
struct Unspoilt {
    surfaces: Pair<Surface>,
    raw_resolution: f64,
    resolution: f64,
    /// Lengths are those of the pair without nuisances: a nuisance changes the data, not the settings.
    config: PipelineConfig,
}

/// The surfaces on which keypoints are detected.
struct Ground {
    surfaces: Pair<Surface>,
    /// From the centred target, with its nuisance, to the centred target without.
    to_clean: RigidTransform,
}

/// The scan that features belong to, with the nuisance that they depend on.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Source(Nuisance),
    Target(Nuisance),
}

/// The results of the chain under a nuisance, up to the matches.
pub(super) struct Case {
    pub(super) surfaces: Pair<Surface>,
    pub(super) matches: Rc<Vec<Correspondence>>,
    pub(super) resolution: f64,
    pub(super) judge: Rc<GroundTruth>,
    pub(super) to_clean: RigidTransform,
}

impl<'a> Bench<'a> {
    pub(super) fn new(scans: Pair<&'a RawScan>, truth: &RigidTransform) -> Result<Self, Problem> {
        let clean = scans.par_map(Scan::new).both()?;
        let judge = Rc::new(GroundTruth::of_scans(clean.as_ref(), truth));
        Ok(Bench {
            scans,
            clean,
            truth: *truth,
            judge,
            unspoilt: Shelf::default(),
            grounds: Shelf::default(),
            features: Shelf::default(),
            matches: Shelf::default(),
        })
    }

    /// Runs the chain up to the matches, with a nuisance on the target; the source scan and the settings are those
    /// without it. With a budget, the grid of both scans adapts to the points left.
    pub(super) fn case(
        &mut self,
        config: &PipelineConfig,
        nuisance: Nuisance,
        measured_on: MeasuredOn,
    ) -> Result<Case, Problem> {
        let unspoilt = self.unspoilt(config)?;
        let judge = self.judge(measured_on, &unspoilt.surfaces);
        if !judge.is_evaluable() {
            return Err(Problem::NotEvaluable { shared: judge.n_shared() });
        }
        let ground = self.ground(config, nuisance, &unspoilt)?;
        let matches = self.matches(config, nuisance, &ground, unspoilt.resolution);
        let Ground { surfaces, to_clean } = &*ground;
        let resolution = unspoilt.resolution;
        Ok(Case { surfaces: surfaces.clone(), matches, resolution, judge, to_clean: *to_clean })
    }

    fn judge(&self, on: MeasuredOn, surfaces: &Pair<Surface>) -> Rc<GroundTruth> {
        match on {
            MeasuredOn::Scans => self.judge.clone(),
            MeasuredOn::Sampled => {
                let origins = self.clean.as_ref().map(|scan| *scan.origin());
                let points = Pair { source: surfaces.source.points(), target: surfaces.target.points() };
                Rc::new(GroundTruth::of_points(points, origins, &self.truth))
            }
        }
    }

    fn unspoilt(&mut self, config: &PipelineConfig) -> Result<Rc<Unspoilt>, Problem> {
        let clean = &self.clean;
        self.unspoilt.get_or(up_to_surfaces(config), || {
            let Prepared { surfaces, raw_resolution, resolution } =
                stages::prepare(&[&clean.source, &clean.target], config, None)?;
            let config = with_fixed_leaf(config, raw_resolution);
            Ok(Unspoilt { surfaces: Pair::of_two(surfaces), raw_resolution, resolution, config })
        })
    }

    fn ground(
        &mut self,
        config: &PipelineConfig,
        nuisance: Nuisance,
        unspoilt: &Unspoilt,
    ) -> Result<Rc<Ground>, Problem> {
        let (scans, clean) = (&self.scans, &self.clean);
        self.grounds.get_or((up_to_surfaces(config), nuisance), || {
            if nuisance == (Nuisance::None {}) {
                return Ok(Ground { surfaces: unspoilt.surfaces.clone(), to_clean: RigidTransform::identity() });
            }
            let spoilt = Scan::new(&nuisance.apply(scans.target, unspoilt.raw_resolution, config.seed))?;
            let offset = spoilt.origin() - clean.target.origin();
            let both = [&clean.source, &spoilt];
            let wanted = if depends_on_both(config) { &both[..] } else { &both[1..] };
            let mut prepared = stages::prepare(wanted, &unspoilt.config, Some(unspoilt.resolution))?.surfaces;
            let target = prepared.pop().expect("as many surfaces as scans");
            let source = prepared.pop().unwrap_or_else(|| unspoilt.surfaces.source.clone());
            let to_clean = RigidTransform::translation(offset.x, offset.y, offset.z);
            Ok(Ground { surfaces: Pair { source, target }, to_clean })
        })
    }

    fn matches(
        &mut self,
        config: &PipelineConfig,
        nuisance: Nuisance,
        ground: &Ground,
        resolution: f64,
    ) -> Rc<Vec<Correspondence>> {
        let of_source = if depends_on_both(config) { nuisance } else { Nuisance::None {} };
        let surfaces = &ground.surfaces;
        let mut features = |side, surface| {
            self.features.always((up_to_features(config), side), || described(surface, config, resolution))
        };
        let source = features(Side::Source(of_source), &surfaces.source);
        let target = features(Side::Target(nuisance), &surfaces.target);
        self.matches.always((up_to_matches(config), nuisance), || stages::match_features(&source, &target, config))
    }
}

/// Returns whether the surface of one scan depends on the other: a budget applies to both, and given normals are used only
/// if both have them.
fn depends_on_both(config: &PipelineConfig) -> bool {
    matches!(config.sampling, SamplingConfig::Budget(_)) || config.normals.source == NormalSource::Given
}

fn described(surface: &Surface, config: &PipelineConfig, resolution: f64) -> Features {
    let keypoints = stages::detect(surface, config, resolution);
    let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
    stages::describe(surface, &points, config, resolution)
}

/// Returns the settings on which surfaces depend, with defaults for all others.
fn up_to_surfaces(config: &PipelineConfig) -> PipelineConfig {
    let PipelineConfig { seed, sampling, normals, .. } = config.clone();
    PipelineConfig { seed, sampling, normals, ..PipelineConfig::default() }
}

/// Returns the settings on which features depend.
fn up_to_features(config: &PipelineConfig) -> PipelineConfig {
    let PipelineConfig { detector, support, descriptor, .. } = config.clone();
    PipelineConfig { detector, support, descriptor, ..up_to_surfaces(config) }
}

/// Returns the settings on which matches depend.
fn up_to_matches(config: &PipelineConfig) -> PipelineConfig {
    PipelineConfig { matcher: config.matcher.clone(), ..up_to_features(config) }
}

/// The names of the settings that an experiment reads. Estimators and metrics are those of the plan, and the best
/// hypothesis is the answer as it was drawn.
pub const SETTINGS_READ: [&str; 8] =
    ["seed", "sampling", "normals", "detector", "support", "descriptor", "frame", "matcher"];

/// Returns the settings that an experiment reads, with defaults for all others.
pub(super) fn what_is_read(config: &PipelineConfig) -> PipelineConfig {
    PipelineConfig { frame: config.frame.clone(), ..up_to_matches(config) }
}

/// Returns the settings with the side of the cells in data units, so that the grid is the same for any scan.
fn with_fixed_leaf(config: &PipelineConfig, raw_resolution: f64) -> PipelineConfig {
    let mut config = config.clone();
    let leaf = match &mut config.sampling {
        SamplingConfig::None {} => return config,
        SamplingConfig::VoxelGrid(grid) => &mut grid.leaf,
        SamplingConfig::Budget(budget) => &mut budget.leaf,
    };
    *leaf = Length::Units(leaf.resolve(raw_resolution));
    config
}

/// Values made once for each key. There are few keys, so they are searched one by one.
struct Shelf<K, V>(Vec<(K, Rc<V>)>);

impl<K, V> Default for Shelf<K, V> {
    fn default() -> Self {
        Shelf(Vec::new())
    }
}

impl<K: PartialEq, V> Shelf<K, V> {
    fn get_or(&mut self, key: K, make: impl FnOnce() -> Result<V, Problem>) -> Result<Rc<V>, Problem> {
        if let Some((_, value)) = self.0.iter().find(|(known, _)| *known == key) {
            return Ok(value.clone());
        }
        let value = Rc::new(make()?);
        self.0.push((key, value.clone()));
        Ok(value)
    }

    fn always(&mut self, key: K, make: impl FnOnce() -> V) -> Rc<V> {
        self.get_or(key, || Ok(make())).expect("making it cannot fail")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_simulation::pair::{PairOptions, figurine_pair};

    #[test]
    fn the_settings_that_are_read_are_the_named_ones() {
        let other: PipelineConfig = toml::from_str(
            "seed = 1\nquick = []\nescalation = []\nsampling.none = {}\ndetector.iss = {}\nsupport.min-points = 4\n\
             descriptor.shot = {}\nframe.shot = {}\nmatcher.ratio = {}\nestimator.ransac = {}\nmetric.mae = {}\n\
             pool.poses = 1\nranking.none = {}\nrefinement.none = {}\nverdict.a-contrario = {}\n\
             normals.source = 'given'",
        )
        .unwrap();
        let table = |config: &PipelineConfig| toml::Table::try_from(config).unwrap();
        let (usual, all, read) = (table(&PipelineConfig::default()), table(&other), table(&what_is_read(&other)));
        for (name, value) in &usual {
            assert_ne!(all[name], *value, "{name}: the test needs another value");
            assert_eq!(read[name] != *value, SETTINGS_READ.contains(&name.as_str()), "{name}");
        }
        assert!(SETTINGS_READ.iter().all(|name| usual.contains_key(*name)));
    }

    #[test]
    fn what_is_shared_is_what_would_be_made_afresh() {
        let pair = figurine_pair(&PairOptions { pixels: 130, view_angle: 0.4, ..PairOptions::default() });
        let scans = Pair { source: &pair.source, target: &pair.target };
        let bench = || Bench::new(scans, &pair.target_from_source).unwrap();
        let config = PipelineConfig::default();
        let grid = SamplingConfig::VoxelGrid(Default::default());
        for config in [PipelineConfig { sampling: grid, ..config.clone() }, config] {
            let mut shared = bench();
            for nuisance in [Nuisance::None {}, Nuisance::Noise(0.3), Nuisance::Holes(6), Nuisance::Noise(0.3)] {
                let ours = shared.case(&config, nuisance, MeasuredOn::Scans).unwrap();
                let fresh = bench().case(&config, nuisance, MeasuredOn::Scans).unwrap();
                assert_eq!(ours.matches, fresh.matches, "{nuisance}");
                assert_eq!(ours.surfaces.source.points(), fresh.surfaces.source.points());
                assert!(ours.matches.len() > 20, "{nuisance}: {}", ours.matches.len());
            }
            assert_eq!((shared.matches.0.len(), shared.unspoilt.0.len()), (3, 1));
        }
    }
}
