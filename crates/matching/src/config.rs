//! User settings for matching.

use crate::{Matcher, Mutual, Nearest, RatioRanked, TopK};
use serde::{Deserialize, Serialize};

/// The choice of a matcher.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatcherConfig {
    /// Nearest descriptor, closest first.
    Nearest(NearestConfig),
    /// Nearest descriptor, ranked by Lowe's ratio, the best fraction kept.
    Ratio(RatioConfig),
    /// Mutual nearest descriptors, ranked by Lowe's ratio.
    Mutual(MutualConfig),
    /// The k nearest descriptors of each keypoint.
    TopK(TopKConfig),
}

/// No settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct NearestConfig {}

/// Settings of `[matcher.ratio]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct RatioConfig {
    /// Fraction kept, above 0 and at most 1 (the paper: 0.3).
    #[serde(deserialize_with = "congruent_geometry::numbers::share")]
    pub keep: f64,
}

/// Settings of `[matcher.mutual]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct MutualConfig {
    /// Maximum number of matches.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub limit: usize,
}

/// Settings of `[matcher.top-k]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct TopKConfig {
    /// Number of candidates for each keypoint.
    #[serde(deserialize_with = "congruent_geometry::numbers::at_least::<1, _, _>")]
    pub k: usize,
}

impl Default for RatioConfig {
    fn default() -> Self {
        RatioConfig { keep: 0.3 }
    }
}

impl Default for MutualConfig {
    fn default() -> Self {
        MutualConfig { limit: 4000 }
    }
}

impl Default for TopKConfig {
    fn default() -> Self {
        TopKConfig { k: 3 }
    }
}

impl Default for MatcherConfig {
    fn default() -> Self {
        MatcherConfig::Ratio(RatioConfig::default())
    }
}

impl MatcherConfig {
    /// Builds the matcher that these settings describe.
    #[must_use]
    pub fn build(&self) -> Box<dyn Matcher> {
        match self {
            MatcherConfig::Nearest(NearestConfig {}) => Box::new(Nearest),
            MatcherConfig::Ratio(c) => Box::new(RatioRanked { keep: c.keep }),
            MatcherConfig::Mutual(c) => Box::new(Mutual { limit: c.limit }),
            MatcherConfig::TopK(c) => Box::new(TopK { k: c.k }),
        }
    }
}
