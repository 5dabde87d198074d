//! Many pairs of few scans: each scan is described once, with lengths that all pairs share.
//!
//! [`register`](crate::register) takes its lengths from the two scans of a pair, so a scan that occurs in ten pairs is
//! described ten times. A [`Collection`] determines the lengths once: `pr` of the scans as provided and `pr` after
//! sampling are the medians of the values that the scans have individually. With `[sampling.budget]` the side of a cell
//! is two `pr`, so the grid is the one that suits the median scan. All steps of the escalation are available: a step
//! with another budget has its own grid, and a scan is described for it (or with its normals turned) only when a pair
//! needs it.

mod described;
mod summary;

pub use described::{DescribedScan, Variant};
pub use summary::ScanSummary;

use crate::chain::{Chain, Proposals};
use crate::memory::{Memory, SampledPair};
use crate::preparation::sample;
use crate::prepared::PreparedPair;
use crate::register::{Attempt, escalated};
use crate::stage::Clock;
use crate::{
    BudgetConfig, Counts, Failure, NormalSource, Pair, PipelineConfig, Prior, Registration, SamplingConfig, Settings,
    Signs, Stage, Trace,
};
use crate::{VoxelGridConfig, stages};
use congruent_geometry::{Length, Scan};
use described::Described;
use std::sync::Arc;
use summary::{descriptors, samplings};

/// The lengths that many scans share, and the configuration with which they are described and registered.
#[derive(Clone, Debug)]
pub struct Collection {
    config: PipelineConfig,
    raw_resolution: f64,
    /// `pr` after sampling for each budget of the configuration, data units.
    resolutions: Vec<f64>,
}

impl Collection {
    /// Determines the shared lengths; `None` for no scans. The summaries must have been made with the same
    /// configuration. Unless all scans have normals of their own, all normals are estimated.
    #[must_use]
    pub fn new(scans: &[ScanSummary], config: &PipelineConfig) -> Option<Collection> {
        let budgets = samplings(config).len();
        let mut config = config.clone();
        if !scans.iter().all(|scan| scan.has_normals) {
            config.normals.source = NormalSource::Estimated;
        }
        Some(Collection {
            raw_resolution: median(scans.iter().map(|scan| scan.raw_resolution))?,
            resolutions: (0..budgets)
                .map(|budget| median(scans.iter().map(|scan| scan.resolutions[budget])))
                .collect::<Option<_>>()?,
            config,
        })
    }

    /// Returns the shared lengths, data units: `pr` of the scans as provided, then `pr` after sampling for each budget,
    /// that of the plain configuration first.
    #[must_use]
    pub fn lengths(&self) -> Vec<f64> {
        std::iter::once(self.raw_resolution).chain(self.resolutions.iter().copied()).collect()
    }

    /// Replaces the lengths by those of an earlier run, as [`Collection::lengths`] returned them; `None` if their
    /// number is not that of this configuration, or if one of them is not positive and finite.
    #[must_use]
    pub fn with_lengths(mut self, lengths: &[f64]) -> Option<Collection> {
        let (raw_resolution, resolutions) = lengths.split_first()?;
        let is_alike = resolutions.len() == self.resolutions.len() && lengths.iter().all(|v| *v > 0.0 && v.is_finite());
        self.raw_resolution = *raw_resolution;
        self.resolutions = resolutions.to_vec();
        is_alike.then_some(self)
    }

    /// Returns the meaning of `pr` after sampling with the budget of the plain configuration, data units.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.resolutions[0]
    }

    /// Samples and describes a scan, independently of the seed. If the scan cannot be sampled, the reason is kept in
    /// the result.
    #[must_use]
    pub fn describe(&self, scan: &Scan, variant: Variant) -> DescribedScan {
        let described = self.described(scan, variant);
        DescribedScan { points: scan.points().len(), origin: *scan.origin(), extent: scan.extent().max(), described }
    }

    fn described(&self, scan: &Scan, variant: Variant) -> Result<Described, Failure> {
        let (config, resolution) = (&self.config, self.resolutions[variant.budget]);
        let sampled = sample(&[scan], &self.sampling(variant.budget), config.normals.source)?;
        let strays = sampled.strays.iter().sum();
        let (surface, oriented) =
            stages::normals(sampled.clouds, config, resolution).pop().expect("one surface for one scan");
        let surface = if variant.turned { surface.flipped() } else { surface };
        let keypoints = stages::detect(&surface, config, resolution);
        let points: Vec<u32> = keypoints.iter().map(|keypoint| keypoint.index).collect();
        let descriptor = descriptors(config)[variant.descriptor].clone();
        let config = PipelineConfig { descriptor, ..config.clone() };
        let features = stages::describe(&surface, &points, &config, resolution);
        Ok(Described { strays, surface, oriented, keypoints, features })
    }

    /// Returns the sampling that all scans share, with the side of its cells in data units.
    fn sampling(&self, position: usize) -> SamplingConfig {
        match &self.config.sampling {
            SamplingConfig::None {} => SamplingConfig::None {},
            SamplingConfig::VoxelGrid(grid) => SamplingConfig::VoxelGrid(VoxelGridConfig {
                leaf: Length::Units(grid.leaf.resolve(self.raw_resolution)),
            }),
            SamplingConfig::Budget(budget) => SamplingConfig::Budget(BudgetConfig {
                leaf: Length::Units(2.0 * self.resolutions[position]),
                max_points: usize::MAX,
                strays: budget.strays,
            }),
        }
    }

    /// Registers two scans of the collection, like [`register`](crate::register) but with the lengths of the
    /// collection.
    ///
    /// `supply` returns the source and the target, described in the form that is asked for; it may cache them.
    /// `observe` is called with each stage as it begins; the work of `supply` counts as [`Stage::Description`]. The
    /// result depends only on the scans, the configuration, the lengths, the seed and the prior (of this pair, file
    /// coordinates).
    ///
    /// # Errors
    /// The first error of `supply`.
    pub fn register<E>(
        &self,
        supply: Pair<&dyn Fn(Variant) -> Result<Arc<DescribedScan>, E>>,
        seed: u64,
        prior: &Prior,
        observe: &dyn Fn(Stage),
    ) -> Result<Registration, E> {
        let config = PipelineConfig { seed, ..self.config.clone() };
        let mut clock = Clock::new(observe);
        let as_they_are = Pair { source: Variant::default(), target: Variant::default() };
        let origins = supplied(&supply, as_they_are, &mut clock)?.map(|scan| scan.origin);
        let mut memory = Memory::default();
        let best = escalated(&config, &mut clock, |config, signs, clock| {
            self.attempt(&supply, prior, config, signs, &mut memory, clock)
        })?;
        Ok(best.registration(&origins, clock))
    }

    fn attempt<E>(
        &self,
        supply: &Pair<&dyn Fn(Variant) -> Result<Arc<DescribedScan>, E>>,
        prior: &Prior,
        config: &PipelineConfig,
        signs: Signs,
        memory: &mut Memory,
        clock: &mut Clock<'_>,
    ) -> Result<Option<Attempt>, E> {
        let budget =
            samplings(&self.config).iter().position(|s| *s == config.sampling).expect("a budget of the configuration");
        let descriptor = descriptors(&self.config)
            .iter()
            .position(|d| *d == config.descriptor)
            .expect("a descriptor of the configuration");
        let kept = Variant { budget, descriptor, turned: false };
        let as_they_are = supplied(supply, Pair { source: kept, target: kept }, clock)?;
        let turned = match described(&as_they_are) {
            Ok(both) => match signs.turned(&both.map(|scan| scan.oriented)) {
                Some(turned) => turned,
                None => return Ok(None),
            },
            Err(_) => Pair::default(),
        };
        let scans = supplied(supply, turned.map(|turned| Variant { turned, ..kept }), clock)?;
        let counts = Counts { points: scans.as_ref().map(|scan| scan.points), ..Counts::default() };
        let (raw_resolution, resolution) = (self.raw_resolution, self.resolutions[budget]);
        let proposals = Proposals::Searched;
        let bounds = prior.bounds(&scans.as_ref().map(|scan| scan.origin), raw_resolution);
        let mut chain =
            Chain { config, prior, bounds, proposals, memory, clock, signs, counts, raw_resolution, resolution };
        let mut trace = Trace::default();
        let outcome = described(&scans).and_then(|both| {
            chain.counts.strays = both.map(|scan| scan.strays);
            chain.counts.sampled = both.map(|scan| scan.surface.len());
            chain.counts.keypoints = both.map(|scan| scan.keypoints.len());
            chain.counts.described = both.map(|scan| scan.features.len());
            let oriented = both.map(|scan| scan.oriented);
            let prepared =
                |both: &Pair<&Described>| PreparedPair { surfaces: both.map(|scan| scan.surface.clone()), oriented };
            if signs == Signs::Kept {
                let (prepared, strays) = (prepared(&described(&as_they_are)?), chain.counts.strays);
                let sampled = SampledPair { prepared, strays, raw_resolution, resolution };
                chain.memory.prepared.keep(config.sampling.clone(), &sampled);
            }
            let prepared = prepared(&both);
            chain.answered(&prepared, both.map(|scan| &scan.features), &mut trace)
        });
        let outcome = outcome.map_err(|failure| failure.explained(scans.as_ref().map(|scan| scan.extent)));
        let counts = chain.counts;
        // The trace of one pair among many is not needed.
        let settings = Settings { config: config.clone(), signs };
        Ok(Some(Attempt { settings, outcome, counts, raw_resolution, resolution, trace: Trace::default() }))
    }
}

fn supplied<E>(
    supply: &Pair<&dyn Fn(Variant) -> Result<Arc<DescribedScan>, E>>,
    variants: Pair<Variant>,
    clock: &mut Clock<'_>,
) -> Result<Pair<Arc<DescribedScan>>, E> {
    clock.time(Stage::Description, || {
        Ok(Pair { source: (supply.source)(variants.source)?, target: (supply.target)(variants.target)? })
    })
}

fn described(scans: &Pair<Arc<DescribedScan>>) -> Result<Pair<&Described>, Failure> {
    match (&scans.source.described, &scans.target.described) {
        (Ok(source), Ok(target)) => Ok(Pair { source, target }),
        (Err(failure), _) | (_, Err(failure)) => Err(failure.clone()),
    }
}

/// Returns the middle value, or the mean of the two middle ones; `None` for no values.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DenseVerdictConfig, Verdict, VerdictConfig, register};
    use congruent_geometry::{RigidTransform, mean_displacement};
    use congruent_simulation::nuisances::{moved, scaled};
    use congruent_simulation::pair::{PairOptions, figurine_pair};
    use nalgebra::Vector3;
    use std::convert::Infallible;

    #[test]
    fn the_median_is_in_the_middle() {
        for (values, expected) in
            [(vec![], None), (vec![2.0], Some(2.0)), (vec![9.0, 1.0], Some(5.0)), (vec![3.0, 7.0, 1.0], Some(3.0))]
        {
            assert_eq!(median(values.into_iter()), expected);
        }
    }

    fn registered(scans: &Pair<Scan>, config: &PipelineConfig) -> Registration {
        let summaries: Vec<ScanSummary> =
            [&scans.source, &scans.target].map(|scan| ScanSummary::new(scan, config).unwrap()).to_vec();
        let collection = Collection::new(&summaries, config).unwrap();
        let source = |variant| Ok::<_, Infallible>(Arc::new(collection.describe(&scans.source, variant)));
        let target = |variant| Ok::<_, Infallible>(Arc::new(collection.describe(&scans.target, variant)));
        let Ok(found) =
            collection.register(Pair { source: &source, target: &target }, config.seed, &Prior::default(), &|_| {});
        found
    }

    /// A scan and a moved copy have nearly the same lengths, so hardly anything differs from an ordinary pair; nor does
    /// it if nothing is accepted, so that all attempts are made.
    #[test]
    fn scans_of_equal_lengths_register_as_a_pair_does() {
        let pair = figurine_pair(&PairOptions { pixels: 120, ..PairOptions::default() });
        let motion = RigidTransform::new(Vector3::new(300.0, -20.0, 7.0), Vector3::new(0.4, -1.0, 2.0));
        let copy = moved(&pair.source, &motion);
        let scans = Pair { source: Scan::new(&pair.source).unwrap(), target: Scan::new(&copy).unwrap() };
        let believed = PipelineConfig { seed: 5, ..PipelineConfig::default() };
        let VerdictConfig::Dense(verdict) = &believed.verdict else { panic!("the default looks at the surfaces") };
        let doubtful = PipelineConfig {
            verdict: VerdictConfig::Dense(DenseVerdictConfig { min_stiffness: 1e9, ..verdict.clone() }),
            ..believed.clone()
        };
        for (config, expected) in [(believed, true), (doubtful, false)] {
            let one = registered(&scans, &config);
            let other = register(&scans.source, &scans.target, &config);
            assert_eq!((one.verdict() == Verdict::Ok, other.verdict() == Verdict::Ok), (expected, expected));
            for found in [&one, &other] {
                let off = mean_displacement(scans.source.points(), found.pose().unwrap(), &motion);
                assert!(off < 0.5 * found.resolution, "{off}");
            }
            assert_eq!(one.settings.config.descriptor, other.settings.config.descriptor);
        }
    }

    #[test]
    fn metres_and_millimetres_are_told_apart_among_many_too() {
        let pair = figurine_pair(&PairOptions { pixels: 120, ..PairOptions::default() });
        let small = scaled(&pair.source, 1e-3);
        let scans = Pair { source: Scan::new(&small).unwrap(), target: Scan::new(&pair.target).unwrap() };
        let found = registered(&scans, &PipelineConfig::default());
        assert!(matches!(found.failure(), Some(Failure::OtherUnits { .. })), "{:?}", found.outcome);
    }
}
