//! What a user may say about matching.

use crate::{Matcher, Mutual, Nearest, RatioRanked, TopK};
use serde::{Deserialize, Serialize};

/// The choice of a matcher.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatcherConfig {
    /// Nearest descriptor, closest first.
    Nearest(NearestConfig),
    /// Nearest descriptor, ranked by Lowe's ratio, the best share kept.
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
    /// Share kept, above 0 and at most 1 (the paper: 0.3).
    pub keep: Share,
}

/// Settings of `[matcher.mutual]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct MutualConfig {
    /// At most this many matches.
    pub limit: usize,
}

/// Settings of `[matcher.top-k]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct TopKConfig {
    /// Candidates for each keypoint.
    pub k: usize,
}

/// A number above 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Share(f64);

impl TryFrom<f64> for Share {
    type Error = String;
    fn try_from(value: f64) -> Result<Self, String> {
        if value > 0.0 && value <= 1.0 {
            Ok(Share(value))
        } else {
            Err(format!("{value} is not a share: write a number above 0 and at most 1"))
        }
    }
}

impl From<Share> for f64 {
    fn from(share: Share) -> f64 {
        share.0
    }
}

impl Default for RatioConfig {
    fn default() -> Self {
        RatioConfig { keep: Share(0.3) }
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
    /// The matcher that these settings describe.
    #[must_use]
    pub fn build(&self) -> Box<dyn Matcher> {
        match self {
            MatcherConfig::Nearest(NearestConfig {}) => Box::new(Nearest),
            MatcherConfig::Ratio(c) => Box::new(RatioRanked { keep: c.keep.0 }),
            MatcherConfig::Mutual(c) => Box::new(Mutual { limit: c.limit }),
            MatcherConfig::TopK(c) => Box::new(TopK { k: c.k }),
        }
    }
}
