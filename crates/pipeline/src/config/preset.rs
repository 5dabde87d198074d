//! The configurations that come with the program.

use super::PipelineConfig;
use std::fmt;

/// A configuration that comes with the program, with its comments in `configs/`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// The robust chain: [`PipelineConfig::default`].
    Default,
    /// Fewer points and attempts: about half the time, fewer pairs of little overlap.
    Fast,
    /// The chain of the paper: Harris 3D, SHOT, Lowe's ratio, and RANSAC with the metric MSE; no verdict on the surfaces.
    Paper,
}

impl Preset {
    /// All presets.
    pub const ALL: [Preset; 3] = [Preset::Default, Preset::Fast, Preset::Paper];

    /// Returns the name: `default`, `fast` or `paper`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Preset::Default => "default",
            Preset::Fast => "fast",
            Preset::Paper => "paper",
        }
    }

    /// Returns the preset of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Preset> {
        Preset::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Returns the file with its comments, as TOML.
    #[must_use]
    pub fn toml(self) -> &'static str {
        match self {
            Preset::Default => include_str!("../../../../configs/default.toml"),
            Preset::Fast => include_str!("../../../../configs/fast.toml"),
            Preset::Paper => include_str!("../../../../configs/paper.toml"),
        }
    }
}

impl From<Preset> for PipelineConfig {
    fn from(preset: Preset) -> Self {
        toml::from_str(preset.toml()).expect("the presets are valid")
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_read_and_the_default_is_the_default() {
        for preset in Preset::ALL {
            let config = PipelineConfig::from(preset);
            assert!(config.contradiction().is_none(), "{preset}");
            assert_eq!(Preset::named(preset.name()), Some(preset));
            assert_eq!(config == PipelineConfig::default(), preset == Preset::Default);
        }
        assert_eq!(Preset::named("papers"), None);
    }
}
