//! The user's choice of a descriptor.

use crate::{Descriptor, FpfhConfig, LfshConfig, ShotConfig, SpinImageConfig};
use serde::{Deserialize, Serialize};

/// The choice of a descriptor with its settings: one table of `[descriptor.shot]`, `[descriptor.spin-image]`,
/// `[descriptor.lfsh]`, `[descriptor.fpfh]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DescriptorConfig {
    /// Signatures of histograms of orientations, 352 numbers.
    Shot(ShotConfig),
    /// Spin images, 153 numbers.
    SpinImage(SpinImageConfig),
    /// Local feature statistics histograms, 30 numbers.
    Lfsh(LfshConfig),
    /// Fast point feature histograms, 33 numbers.
    Fpfh(FpfhConfig),
}

impl Default for DescriptorConfig {
    fn default() -> Self {
        DescriptorConfig::Shot(ShotConfig::default())
    }
}

impl DescriptorConfig {
    /// Builds the descriptor for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Box<dyn Descriptor> {
        match self {
            DescriptorConfig::Shot(config) => Box::new(config.build(resolution)),
            DescriptorConfig::SpinImage(config) => Box::new(config.build(resolution)),
            DescriptorConfig::Lfsh(config) => Box::new(config.build(resolution)),
            DescriptorConfig::Fpfh(config) => Box::new(config.build(resolution)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::without_normals;
    use crate::{Fpfh, FpfhVariant};
    use congruent_simulation::testing::{bumpy, plane, surface, with_threads};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Document {
        descriptor: DescriptorConfig,
    }

    fn family() -> [(&'static str, DescriptorConfig, usize); 4] {
        [
            ("shot", DescriptorConfig::Shot(ShotConfig::default()), 352),
            ("spin-image", DescriptorConfig::SpinImage(SpinImageConfig::default()), 153),
            ("lfsh", DescriptorConfig::Lfsh(LfshConfig::default()), 30),
            ("fpfh", DescriptorConfig::Fpfh(FpfhConfig::default()), 33),
        ]
    }

    #[test]
    fn configurations_survive_the_round_trip() {
        for (_, descriptor, _) in family() {
            let document = Document { descriptor };
            let text = toml::to_string(&document).unwrap();
            assert_eq!(toml::from_str::<Document>(&text).unwrap(), document, "{text}");
        }
    }

    #[test]
    fn an_empty_table_means_the_defaults() {
        for (name, expected, _) in family() {
            let document: Document = toml::from_str(&format!("[descriptor.{name}]")).unwrap();
            assert_eq!(document.descriptor, expected);
        }
    }

    #[test]
    fn settings_are_read_and_lengths_resolved() {
        let document: Document = toml::from_str("[descriptor.fpfh]\nradius = \"10pr\"\nvariant = \"open3d\"").unwrap();
        let DescriptorConfig::Fpfh(config) = document.descriptor else { panic!("{document:?}") };
        assert_eq!(config.build(0.5), Fpfh { radius: 5.0, variant: FpfhVariant::Open3d });
    }

    #[test]
    fn mistakes_are_refused() {
        for text in ["[descriptor.spinimage]", "[descriptor.shot]\nradius = 15.0", "[descriptor.lfsh]\nbins = 3"] {
            assert!(toml::from_str::<Document>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn rows_are_finite_and_as_long_as_promised() {
        for surface in [bumpy(30, 1), plane(30)] {
            let all: Vec<u32> = (0..900).collect();
            for (name, config, dim) in family() {
                let features = config.build(0.3).describe(&surface, &all);
                assert_eq!((features.keypoints.len(), features.dim), (900, dim), "{name}");
                assert!(features.rows.len() == 900 * dim && features.rows.iter().all(|v| v.is_finite()));
            }
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let surface = bumpy(30, 2);
        let some: Vec<u32> = (0..900).step_by(7).collect();
        for (name, config, _) in family() {
            let describe = || config.build(0.3).describe(&surface, &some);
            assert_eq!(with_threads(1, describe), with_threads(4, describe), "{name}");
        }
    }

    #[test]
    fn lone_and_coincident_points_are_left_out() {
        for points in [vec![[0.0; 3]], vec![[1.0; 3]; 20], vec![[0.0; 3], [99.0, 0.0, 0.0]]] {
            let surface = surface(points);
            let all: Vec<u32> = (0..surface.len() as u32).collect();
            for (name, config, _) in family() {
                assert!(config.build(1.0).describe(&surface, &all).is_empty(), "{name}");
            }
        }
    }

    #[test]
    fn without_normals_there_is_nothing_to_describe() {
        let bare = without_normals(&bumpy(20, 3));
        for (name, config, _) in family() {
            assert!(config.build(0.3).describe(&bare, &[0, 200]).is_empty(), "{name}");
        }
    }
}
