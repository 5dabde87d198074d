//! User settings for the estimators that work on the compatibility graph.

use crate::thinning::of_few_edges;
use crate::{Cliques, Compatibility, Graph, Pivots, Pruning, SeedRule, Seeds};
use congruent_geometry::Length;
use congruent_metrics::Evidence;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Settings of the compatibility graph, for instance `[estimator.pivots.graph]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct GraphConfig {
    /// Maximum difference of the distance between two correspondences in the two scans.
    pub tolerance: Length,
    /// Correspondences closer together than this are not joined.
    pub min_distance: Length,
    /// Maximum difference of the angle between two normals in the two scans, radians.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_angle: f64,
    /// Maximum difference of the cosine between a normal and the line to the other point in the two scans.
    #[serde(deserialize_with = "congruent_geometry::numbers::not_negative")]
    pub max_cosine: f64,
    /// What is removed from the graph first.
    pub pruning: Pruning,
}

/// Settings of `[estimator.pivots]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct PivotsConfig {
    /// Maximum number of pivots; each proposes two poses.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub pivots: usize,
    /// Which correspondences are joined.
    pub graph: GraphConfig,
}

/// Settings of `[estimator.seeds]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct SeedsConfig {
    /// Distance that the source points of two seeds must exceed.
    pub separation: Length,
    /// Maximum number of seeds as a fraction of the correspondences; each proposes one pose.
    #[serde(deserialize_with = "congruent_geometry::numbers::share")]
    pub share: f64,
    /// Number of correspondences that a seed gathers, itself included.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<3, _, _>")]
    pub gathered: usize,
    /// Number of those that are fitted.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<3, _, _>")]
    pub kept: usize,
    /// Which correspondences are joined; shared neighbours are counted with half of its tolerance.
    pub graph: GraphConfig,
}

/// Settings of `[estimator.cliques]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct CliquesConfig {
    /// Number of branches of the search that are followed to their end, for each correspondence.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub branches: usize,
    /// Which correspondences are joined.
    pub graph: GraphConfig,
}

impl Default for GraphConfig {
    fn default() -> Self {
        GraphConfig {
            tolerance: Length::Resolutions(4.0),
            min_distance: Length::Resolutions(8.0),
            max_angle: 0.45,
            max_cosine: 0.4,
            pruning: Pruning::default(),
        }
    }
}

impl Default for PivotsConfig {
    fn default() -> Self {
        PivotsConfig { graph: GraphConfig::default(), pivots: 8000 }
    }
}

impl Default for SeedsConfig {
    /// Returns the authors' numbers for FPFH-like descriptors; they separate seeds by the tolerance.
    fn default() -> Self {
        let graph = GraphConfig::default();
        SeedsConfig { separation: graph.tolerance, share: 0.2, gathered: 30, kept: 20, graph }
    }
}

impl Default for CliquesConfig {
    fn default() -> Self {
        CliquesConfig { graph: GraphConfig::default(), branches: 10 }
    }
}

impl GraphConfig {
    /// Builds the graph of these correspondences, or of a manageable subset of them, for clouds of this resolution.
    fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> (Cow<'a, Evidence>, Graph) {
        let rule = Compatibility {
            tolerance: self.tolerance.resolve(resolution),
            min_distance: self.min_distance.resolve(resolution),
            max_angle: self.max_angle,
            max_cosine: self.max_cosine,
        };
        let evidence = of_few_edges(evidence, &rule);
        let graph = Graph::new(&evidence, &rule).pruned(self.pruning);
        (evidence, graph)
    }
}

impl PivotsConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Pivots<'a> {
        let (evidence, graph) = self.graph.build(evidence, resolution);
        Pivots::new(evidence, &graph, self.pivots)
    }
}

impl SeedsConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Seeds<'a> {
        let seeds = SeedRule {
            tolerance: self.graph.tolerance.resolve(resolution),
            separation: self.separation.resolve(resolution),
            share: self.share,
            gathered: self.gathered,
            kept: self.kept,
        };
        let (evidence, graph) = self.graph.build(evidence, resolution);
        Seeds::new(evidence, graph, seeds)
    }
}

impl CliquesConfig {
    pub(super) fn build<'a>(&self, evidence: &'a Evidence, resolution: f64) -> Cliques<'a> {
        let (evidence, graph) = self.graph.build(evidence, resolution);
        Cliques::new(evidence, &graph, self.branches)
    }
}
