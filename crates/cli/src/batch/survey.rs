//! The first look at every scan: whether it can be read, and how large it is.

use super::cache::{Cache, Key};
use super::input::{Input, ScanFile};
use super::work::guarded;
use crate::commands::{load, on_threads};
use anyhow::Result;
use congruent_pipeline::{Collection, PipelineConfig, ScanSummary, Variant};
use nalgebra::Vector3;
use rayon::prelude::*;

/// What is known of all scans.
pub(crate) struct Survey {
    /// In the order of the input; or why a scan cannot be used.
    pub(crate) scans: Vec<Result<Surveyed, String>>,
    /// Nothing where no scan can be used.
    pub(crate) collection: Option<Collection>,
}

pub(crate) struct Surveyed {
    pub(super) summary: ScanSummary,
    /// Middle of the bounding box, file coordinates.
    pub(crate) centre: Vector3<f64>,
}

impl Survey {
    pub(super) fn of(input: &Input, config: &PipelineConfig, threads: usize) -> Result<Survey> {
        let look = |file: &ScanFile| {
            guarded(|| {
                let scan = load(&file.path).map_err(|error| format!("{error:#}"))?.scan;
                let summary =
                    ScanSummary::new(&scan, config).map_err(|failure| format!("{}: {failure}", file.path.display()))?;
                Ok(Surveyed { summary, centre: *scan.origin() })
            })
            .and_then(|result| result)
        };
        let scans: Vec<Result<Surveyed, String>> =
            on_threads(u16::try_from(threads).ok(), || input.scans.par_iter().map(look).collect())?;
        let good: Vec<ScanSummary> = scans.iter().flatten().map(|scan| scan.summary.clone()).collect();
        Ok(Survey { collection: Collection::new(&good, config), scans })
    }

    /// A signature for each scan, empty where there is none.
    pub(super) fn signatures(&self, input: &Input, cache: &Cache, threads: usize) -> Result<Vec<Vec<f64>>> {
        let of = |at: usize| match self.described(input, cache, at, Variant::default()) {
            Ok(described) => described.signature(),
            Err(_) => Vec::new(),
        };
        on_threads(u16::try_from(threads).ok(), || (0..input.scans.len()).into_par_iter().map(of).collect())
    }

    /// A scan with its descriptors, made or remembered.
    pub(crate) fn described(&self, input: &Input, cache: &Cache, at: usize, variant: Variant) -> super::cache::Entry {
        let collection = match (&self.scans[at], &self.collection) {
            (Err(message), _) => return Err(message.clone()),
            (Ok(_), None) => unreachable!("a scan that can be used makes a collection"),
            (Ok(_), Some(collection)) => collection,
        };
        cache.get(Key { scan: at, variant }, || {
            guarded(|| {
                let scan = load(&input.scans[at].path).map_err(|error| format!("{error:#}"))?.scan;
                Ok(collection.describe(&scan, variant).into())
            })
            .and_then(|result| result)
        })
    }

    /// Points of a scan; none where it cannot be used.
    pub(crate) fn points(&self, at: usize) -> usize {
        self.scans[at].as_ref().map_or(0, |scan| scan.summary.points)
    }
}
