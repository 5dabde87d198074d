//! What the attempts at one pair share: a stage is not run again with the same settings.

use crate::prepared::PreparedPair;
use crate::ranking::{Fields, Order, Ranked};
use crate::stages::Pool;
use crate::{Pair, PipelineConfig, SamplingConfig, Signs};
use congruent_descriptors::{DescriptorConfig, Features};
use congruent_estimators::EstimatorConfig;
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;
use std::sync::Arc;

/// Results of the stages for one pair so far. The keys contain only those settings that an escalation step can change.
#[derive(Default)]
pub(crate) struct Memory {
    /// By sampling; normals as they were oriented, before an attempt turns them.
    pub(crate) prepared: Known<SamplingConfig, SampledPair>,
    pub(crate) fields: Known<SamplingConfig, Pair<Arc<Fields>>>,
    pub(crate) described: Known<Setting, (Pair<Vec<Keypoint>>, Pair<Features>)>,
    pub(crate) matches: Known<Setting, Vec<Correspondence>>,
    pub(crate) pools: Known<Search, Pool>,
    pub(crate) orders: Known<Search, Order>,
    /// The answer with the best score of the ranking.
    pub(crate) best: Known<(SamplingConfig, Signs), Ranked>,
}

/// Surfaces, and the lengths that belong to them in data units.
#[derive(Clone)]
pub(crate) struct SampledPair {
    pub(crate) prepared: PreparedPair,
    /// Number of points that were left out as strays.
    pub(crate) strays: Pair<usize>,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
}

/// The settings on which descriptors and matches depend.
#[derive(Clone, PartialEq)]
pub(crate) struct Setting {
    sampling: SamplingConfig,
    signs: Signs,
    descriptor: DescriptorConfig,
}

impl Setting {
    pub(crate) fn new(config: &PipelineConfig, signs: Signs) -> Self {
        Setting { sampling: config.sampling.clone(), signs, descriptor: config.descriptor.clone() }
    }
}

/// The settings on which the pool of poses depends.
#[derive(Clone, PartialEq)]
pub(crate) struct Search {
    setting: Setting,
    estimator: EstimatorConfig,
    poses: usize,
}

impl Search {
    pub(crate) fn new(config: &PipelineConfig, signs: Signs) -> Self {
        let (estimator, poses) = (config.estimator.clone(), config.pool.poses);
        Search { setting: Setting::new(config, signs), estimator, poses }
    }
}

/// A short list of results, each with its key.
pub(crate) struct Known<K, V>(Vec<(K, V)>);

impl<K, V> Default for Known<K, V> {
    fn default() -> Self {
        Known(Vec::new())
    }
}

impl Memory {
    /// Returns the surfaces with the smallest resolution so far, and their sampling.
    pub(crate) fn finest(&self) -> Option<&(SamplingConfig, SampledPair)> {
        self.prepared.0.iter().min_by(|(_, a), (_, b)| a.resolution.total_cmp(&b.resolution))
    }

    /// Keeps an answer unless there is one with at least its score.
    pub(crate) fn note(&mut self, sampling: &SamplingConfig, signs: Signs, ranked: &Ranked) {
        let key = (sampling.clone(), signs);
        if self.best.get(&key).is_none_or(|best| ranked.score.value() > best.score.value()) {
            self.best.keep(key, ranked);
        }
    }
}

impl<K: PartialEq, V: Clone> Known<K, V> {
    pub(crate) fn get(&self, key: &K) -> Option<V> {
        self.0.iter().find(|(known, _)| known == key).map(|(_, value)| value.clone())
    }

    /// Keeps a value, and replaces the one with the same key.
    pub(crate) fn keep(&mut self, key: K, value: &V) {
        self.0.retain(|(known, _)| *known != key);
        self.0.push((key, value.clone()));
    }
}
