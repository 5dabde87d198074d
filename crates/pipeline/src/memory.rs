//! What the attempts at one pair share: a stage whose settings are the same is not run again.

use crate::prepared::PreparedPair;
use crate::ranking::{Fields, Order, Ranked};
use crate::stages::Pool;
use crate::{Pair, PipelineConfig, SamplingConfig, Signs};
use congruent_descriptors::{DescriptorConfig, Features};
use congruent_estimators::EstimatorConfig;
use congruent_keypoints::Keypoint;
use congruent_matching::Correspondence;
use std::sync::Arc;

/// What has been made for one pair so far. Of the settings only those are looked at that an escalation can change.
#[derive(Default)]
pub(crate) struct Memory {
    /// By sampling; with the signs of the normals as they were settled.
    pub(crate) prepared: Known<SamplingConfig, SampledPair>,
    pub(crate) fields: Known<SamplingConfig, Pair<Arc<Fields>>>,
    pub(crate) described: Known<Setting, (Pair<Vec<Keypoint>>, Pair<Features>)>,
    pub(crate) matches: Known<Setting, Vec<Correspondence>>,
    pub(crate) pools: Known<Search, Pool>,
    pub(crate) orders: Known<Search, Order>,
    /// The answer that the surfaces liked best.
    pub(crate) best: Known<(SamplingConfig, Signs), Ranked>,
}

/// Surfaces and the lengths that go with them.
#[derive(Clone)]
pub(crate) struct SampledPair {
    pub(crate) prepared: PreparedPair,
    /// Points that were left out.
    pub(crate) strays: Pair<usize>,
    pub(crate) raw_resolution: f64,
    pub(crate) resolution: f64,
}

/// What descriptors and matches depend on.
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

/// What the pool of poses depends on.
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

/// A short list of things made, by what they were made for.
pub(crate) struct Known<K, V>(Vec<(K, V)>);

impl<K, V> Default for Known<K, V> {
    fn default() -> Self {
        Known(Vec::new())
    }
}

impl Memory {
    /// The surfaces with the smallest resolution so far, and their sampling.
    pub(crate) fn finest(&self) -> Option<&(SamplingConfig, SampledPair)> {
        self.prepared.0.iter().min_by(|(_, a), (_, b)| a.resolution.total_cmp(&b.resolution))
    }

    /// Keeps an answer unless there is a better one.
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

    /// In place of what was kept for the same.
    pub(crate) fn keep(&mut self, key: K, value: &V) {
        self.0.retain(|(known, _)| *known != key);
        self.0.push((key, value.clone()));
    }
}
