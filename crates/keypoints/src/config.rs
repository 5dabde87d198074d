//! The user's choice of a detector.

use crate::{Detector, HarrisConfig, IssConfig, UniformConfig};
use serde::{Deserialize, Serialize};

/// The choice of a detector with its settings: one table of `[detector.harris]`, `[detector.iss]`,
/// `[detector.uniform]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DetectorConfig {
    /// Corners by the spread of normals.
    Harris(HarrisConfig),
    /// Intrinsic Shape Signatures.
    Iss(IssConfig),
    /// An evenly spread subset.
    Uniform(UniformConfig),
}

impl Default for DetectorConfig {
    fn default() -> Self {
        DetectorConfig::Iss(IssConfig::default())
    }
}

impl DetectorConfig {
    /// Builds the detector for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Box<dyn Detector> {
        match self {
            DetectorConfig::Harris(config) => Box::new(config.build(resolution)),
            DetectorConfig::Iss(config) => Box::new(config.build(resolution)),
            DetectorConfig::Uniform(config) => Box::new(config.build(resolution)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Harris, HarrisResponse, Ties};
    use congruent_geometry::Length;
    use congruent_simulation::testing::{bumpy, surface, with_threads};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Document {
        detector: DetectorConfig,
    }

    fn family() -> [DetectorConfig; 3] {
        [
            DetectorConfig::Harris(HarrisConfig::default()),
            DetectorConfig::Iss(IssConfig::default()),
            DetectorConfig::Uniform(UniformConfig::default()),
        ]
    }

    #[test]
    fn configurations_survive_the_round_trip() {
        let bounded = IssConfig { boundary_radius: Some(Length::Units(0.5)), ..IssConfig::default() };
        for detector in family().into_iter().chain([DetectorConfig::Iss(bounded)]) {
            let document = Document { detector };
            let text = toml::to_string(&document).unwrap();
            assert_eq!(toml::from_str::<Document>(&text).unwrap(), document, "{text}");
        }
    }

    #[test]
    fn an_empty_table_means_the_defaults() {
        for (name, expected) in ["harris", "iss", "uniform"].into_iter().zip(family()) {
            let document: Document = toml::from_str(&format!("[detector.{name}]")).unwrap();
            assert_eq!(document.detector, expected);
        }
    }

    #[test]
    fn settings_are_read_and_lengths_resolved() {
        let text = "[detector.harris]\nradius = \"3pr\"\nresponse = \"tomasi\"\nthreshold = 0.01\nties = \"keep-all\"";
        let document: Document = toml::from_str(text).unwrap();
        let DetectorConfig::Harris(config) = document.detector else { panic!("{document:?}") };
        let expected = Harris {
            radius: 1.5,
            response: HarrisResponse::Tomasi,
            threshold: 0.01,
            ties: Ties::KeepAll,
            placement: crate::Placement::Kept,
            step: 0.0005,
        };
        assert_eq!(config.build(0.5), expected);
    }

    #[test]
    fn mistakes_are_refused() {
        for text in ["[detector.haris]", "[detector.iss]\nradius = \"2pr\"", "[detector.uniform]\nleaf = 4.0"] {
            assert!(toml::from_str::<Document>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let surface = bumpy(40, 8);
        for config in family() {
            let detect = || config.build(surface.resolution()).detect(&surface);
            let one = with_threads(1, detect);
            assert!(!one.is_empty() && one.is_sorted_by_key(|k| k.index));
            assert_eq!(one, with_threads(4, detect));
        }
    }

    #[test]
    fn few_or_coincident_points_are_no_trouble() {
        for points in [vec![], vec![[1.0; 3]], vec![[1.0; 3]; 20], vec![[0.0; 3], [1.0, 0.0, 0.0]]] {
            for config in family() {
                let n_keypoints = config.build(1.0).detect(&surface(points.clone())).len();
                assert!(n_keypoints <= points.len());
            }
        }
    }
}
