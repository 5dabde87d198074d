//! What the rows of a run depend on, and whether those of another run are the same.

use super::hash_of;
use super::input::{Input, ScanFile};
use super::pairs::Job;
use super::results::CONFIGURATION;
use super::survey::{Survey, Surveyed};
use super::work::Share;
use crate::fingerprint::fnv;
use anyhow::{Context, Result};
use congruent_io::write_file;
use congruent_pipeline::PipelineConfig;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The file in the folder of results.
const RUN: &str = "run.json";
/// The only shard of a run that is not divided.
pub(super) const WHOLE: [usize; 2] = [1, 1];

/// What the rows of a folder depend on: `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Run {
    pub(super) version: String,
    /// Hash of the settings.
    pub(super) configuration: String,
    /// Lengths of the collection, data units.
    pub(super) lengths: Vec<f64>,
    /// Number of pairs in the whole run, all shards together.
    pub(super) pairs: usize,
    /// Hash of what the input says about all pairs: ids, scans, true and initial poses.
    pub(super) pair_list: String,
    /// Hash of the points of each scan, by its name; none if it cannot be used.
    pub(super) scans: BTreeMap<String, Option<String>>,
    /// Number of this shard, and the number of shards.
    pub(super) shard: [usize; 2],
}

impl Run {
    pub(super) fn new(config: &PipelineConfig, input: &Input, survey: &Survey, jobs: &[Job], shard: Share) -> Run {
        let content = |(file, scan): (&ScanFile, &Result<Surveyed, String>)| {
            (file.name.clone(), scan.as_ref().ok().map(|scan| format!("{:016x}", scan.content)))
        };
        let pairs: String = jobs.iter().map(|job| job.fingerprint(input.names(job)) + "\n").collect();
        Run {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            configuration: hash_of(config),
            lengths: survey.collection.as_ref().map_or_else(Vec::new, congruent_pipeline::Collection::lengths),
            pairs: jobs.len(),
            pair_list: format!("{:016x}", fnv(pairs.as_bytes())),
            scans: input.scans.iter().zip(&survey.scans).map(content).collect(),
            shard: [shard.part, shard.of],
        }
    }

    pub(super) fn read(folder: &Path) -> Result<Run> {
        let path = folder.join(RUN);
        let text = std::fs::read_to_string(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("{}: was not written by a batch of this version", path.display()))
    }

    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("numbers and strings can be written as JSON");
        Ok(write_file(&folder.join(RUN), format!("{text}\n").as_bytes())?)
    }

    /// Returns the same run without shards.
    pub(super) fn whole(&self) -> Run {
        Run { shard: WHOLE, ..self.clone() }
    }

    /// Adds what is known about the scans of a part, or of an earlier run, that cannot be used here.
    pub(super) fn completed(mut self, other: &Run) -> Run {
        for (name, content) in &mut self.scans {
            *content = content.take().or_else(|| other.scans.get(name).cloned().flatten());
        }
        self
    }

    /// Says why the rows of the same pairs would differ in another run, and what to do about it; `None` if they would
    /// not.
    pub(super) fn difference(&self, other: &Run) -> Option<String> {
        if self.configuration != other.configuration {
            Some(format!(
                "its configuration is {}, not {}; use its {CONFIGURATION} with -c, or choose another folder",
                other.configuration, self.configuration
            ))
        } else if self.version != other.version {
            Some(format!("it was written by version {}, not {}; choose another folder", other.version, self.version))
        } else if let Some(name) = self.changed_scan(other) {
            Some(format!(
                "the scan {name} has changed since, or was read with another --thin; use the same --thin, or choose \
                 another folder"
            ))
        } else if let Some(name) = self.other_scan(other) {
            Some(format!(
                "the scan {name} is in only one of the two, and the common lengths depend on all scans; use the same \
                 scans, or choose another folder"
            ))
        } else if self.lengths != other.lengths {
            Some("it has other common lengths; choose another folder".to_owned())
        } else {
            None
        }
    }

    /// Says that another run is about other pairs, and what to do about it; `None` if it is not.
    pub(super) fn other_pairs(&self, other: &Run) -> Option<String> {
        (self.pair_list != other.pair_list || self.pairs != other.pairs).then(|| {
            "it has other pairs, or other poses given for them; use the same input and choice of pairs, or choose \
             another folder"
                .to_owned()
        })
    }

    fn changed_scan(&self, other: &Run) -> Option<&str> {
        let is_another = |now: &Option<String>, then: &Option<String>| now.is_some() && then.is_some() && now != then;
        let changed =
            |(name, now): &(&String, &Option<String>)| other.scans.get(*name).is_some_and(|then| is_another(now, then));
        self.scans.iter().find(changed).map(|(name, _)| name.as_str())
    }

    /// Returns a scan that only one of the two has. An earlier one that could not be used determined no length, and may
    /// be missing.
    fn other_scan<'a>(&'a self, earlier: &'a Run) -> Option<&'a str> {
        let new = self.scans.keys().find(|name| !earlier.scans.contains_key(*name));
        let gone = || {
            let is_gone =
                |(name, content): &(&String, &Option<String>)| content.is_some() && !self.scans.contains_key(*name);
            earlier.scans.iter().find(is_gone).map(|(name, _)| name)
        };
        new.or_else(gone).map(String::as_str)
    }
}
