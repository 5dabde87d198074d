//! What is measured of every scan before the lengths of a collection are determined.

use crate::preparation::{has_normals, sample};
use crate::{Failure, PipelineConfig, SamplingConfig};
use congruent_descriptors::DescriptorConfig;
use congruent_geometry::Scan;

/// What a collection needs to know about a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanSummary {
    /// Number of points of the scan as provided, without those that [`Scan::new`] dropped.
    pub points: usize,
    /// Resolution of the scan as provided, data units.
    pub(super) raw_resolution: f64,
    /// `pr` after sampling for each budget of the configuration, if the scan were alone; data units.
    pub(super) resolutions: Vec<f64>,
    /// Whether the scan has normals of its own.
    pub(super) has_normals: bool,
}

impl ScanSummary {
    /// Measures one scan.
    ///
    /// # Errors
    /// The grid leaves too few points of it.
    pub fn new(scan: &Scan, config: &PipelineConfig) -> Result<ScanSummary, Failure> {
        let mut summary = ScanSummary {
            points: scan.points().len(),
            raw_resolution: 0.0,
            resolutions: Vec::new(),
            has_normals: has_normals(scan),
        };
        for sampling in samplings(config) {
            let sampled = sample(&[scan], &sampling, config.normals.source)?;
            summary.raw_resolution = sampled.raw_resolution;
            summary.resolutions.push(sampled.resolution);
        }
        Ok(summary)
    }
}

/// Returns the samplings that a registration may ask for, that of the plain configuration first.
pub(super) fn samplings(config: &PipelineConfig) -> Vec<SamplingConfig> {
    let others = config.attempts().map(|(config, _)| config.sampling);
    unique(std::iter::once(config.sampling.clone()).chain(others))
}

/// Returns the descriptors that a registration may ask for, that of the plain configuration first.
pub(super) fn descriptors(config: &PipelineConfig) -> Vec<DescriptorConfig> {
    let others = config.attempts().map(|(config, _)| config.descriptor);
    unique(std::iter::once(config.descriptor.clone()).chain(others))
}

fn unique<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut unique = Vec::new();
    all.for_each(|one| {
        if !unique.contains(&one) {
            unique.push(one);
        }
    });
    unique
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_budget_of_the_escalation_is_listed_once() {
        assert_eq!(samplings(&PipelineConfig::default()).len(), 3);
        let none = PipelineConfig { sampling: SamplingConfig::None {}, ..PipelineConfig::default() };
        assert_eq!(samplings(&none), [SamplingConfig::None {}]);
    }
}
