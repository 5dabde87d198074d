//! The first look at every scan: whether it can be read, and how large it is.

use super::board::Board;
use super::cache::{Cache, Entry, Key};
use super::crew::{Crew, Item};
use super::input::{Input, ScanFile};
use super::work::guarded;
use crate::commands::{Reading, load_as};
use crate::fingerprint::hash;
use anyhow::Result;
use congruent_pipeline::{Collection, PipelineConfig, ScanSummary, Variant};
use nalgebra::Vector3;
use std::sync::OnceLock;

/// Memory for a scan while it is read and measured: per byte of its file …
const BYTES_PER_BYTE: u64 = 16;
/// … and independently of its size.
const BYTES_PER_SCAN: u64 = 4 << 20;

/// What is known about all scans.
pub(crate) struct Survey {
    /// In the order of the input; an error says why a scan cannot be used.
    pub(crate) scans: Vec<Result<Surveyed, String>>,
    /// `None` if no scan can be used.
    pub(crate) collection: Option<Collection>,
}

pub(crate) struct Surveyed {
    pub(super) summary: ScanSummary,
    /// Centre of the bounding box, file coordinates.
    pub(crate) centre: Vector3<f64>,
    /// Hash of the points.
    pub(super) content: u64,
}

impl Survey {
    /// Measures all scans; `None` if it was stopped.
    pub(super) fn of(input: &Input, config: &PipelineConfig, crew: &Crew<'_>) -> Result<Option<Survey>> {
        let looked = of_each(input, crew, "measured", |at| measured(&input.scans[at], input.reading, config))?;
        Ok(looked.map(|scans| {
            let good: Vec<ScanSummary> = scans.iter().flatten().map(|scan| scan.summary.clone()).collect();
            Survey { collection: Collection::new(&good, config), scans }
        }))
    }

    /// Returns the survey with the lengths of an earlier run, if they fit the settings.
    pub(super) fn with_lengths(mut self, lengths: &[f64]) -> Survey {
        let other = self.collection.as_ref().and_then(|collection| collection.clone().with_lengths(lengths));
        self.collection = other.or(self.collection);
        self
    }

    /// Returns the signature of each scan, empty if it has none; `None` if it was stopped.
    pub(super) fn signatures(&self, input: &Input, cache: &Cache, crew: &Crew<'_>) -> Result<Option<Vec<Vec<f64>>>> {
        of_each(input, crew, "described", |at| match self.described(input, cache, at, Variant::default()) {
            Ok(described) => described.signature(),
            Err(_) => Vec::new(),
        })
    }

    /// Returns a scan with its descriptors, from the cache or newly computed.
    pub(crate) fn described(&self, input: &Input, cache: &Cache, at: usize, variant: Variant) -> Entry {
        let collection = match (&self.scans[at], &self.collection) {
            (Err(message), _) => return Err(message.clone()),
            (Ok(_), None) => unreachable!("a scan that can be used makes a collection"),
            (Ok(_), Some(collection)) => collection,
        };
        cache.get(Key { scan: at, variant }, || {
            guarded(|| {
                let scan = load_as(&input.scans[at].path, input.reading).map_err(|error| format!("{error:#}"))?.scan;
                Ok(collection.describe(&scan, variant).into())
            })
        })
    }

    /// Returns the number of points of a scan; zero if the scan cannot be used.
    pub(crate) fn points(&self, at: usize) -> usize {
        self.scans[at].as_ref().map_or(0, |scan| scan.summary.points)
    }
}

fn measured(file: &ScanFile, reading: Reading, config: &PipelineConfig) -> Result<Surveyed, String> {
    guarded(|| {
        let scan = load_as(&file.path, reading).map_err(|error| format!("{error:#}"))?.scan;
        let summary =
            ScanSummary::new(&scan, config).map_err(|failure| format!("{}: {failure}", file.path.display()))?;
        let bits = scan.points().iter().flatten().map(|v| u64::from(v.to_bits()));
        let content = hash(bits.chain(scan.origin().iter().map(|v| v.to_bits())));
        Ok(Surveyed { summary, centre: *scan.origin(), content })
    })
}

/// Computes something for each scan, in the order of the input; `None` if it was stopped. `done` is the participle for
/// the progress display, such as "measured".
fn of_each<T: Send + Sync>(
    input: &Input,
    crew: &Crew<'_>,
    done: &str,
    of: impl Fn(usize) -> T + Sync,
) -> Result<Option<Vec<T>>> {
    let bytes = |scan: &ScanFile| {
        let size = std::fs::metadata(&scan.path).map_or(0, |file| file.len());
        BYTES_PER_SCAN + BYTES_PER_BYTE.saturating_mul(size)
    };
    let items: Vec<Item<usize>> =
        input.scans.iter().enumerate().map(|(item, scan)| Item { bytes: bytes(scan), item }).collect();
    let board = Board::quiet(items.len(), &format!("scans {done}"));
    let slots: Vec<OnceLock<T>> = input.scans.iter().map(|_| OnceLock::new()).collect();
    crew.each(items, |_, at| {
        slots[at].get_or_init(|| of(at));
        board.step();
        Ok(())
    })?;
    Ok(slots.into_iter().map(OnceLock::into_inner).collect())
}
