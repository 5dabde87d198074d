//! Layers of settings, and where each setting comes from.

use crate::assignment::{assigned, table_of};
use crate::{SettingsError, parse};
use congruent_pipeline::PipelineConfig;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The origin of settings that no layer sets.
const DEFAULT: &str = "default";

/// A text of TOML, and what messages call it.
#[derive(Clone, Debug)]
pub struct Text {
    /// A file's path, or another name for the user.
    pub name: String,
    /// The settings.
    pub toml: String,
}

/// One setting that is changed, and what messages call it.
#[derive(Clone, Debug)]
pub struct Assignment {
    /// What the user wrote, for the user.
    pub name: String,
    /// `KEY=VALUE`, where the key is dotted (`metric.mse.threshold=5pr`). A family takes the bare name of a member
    /// (`metric=mse`).
    pub text: String,
}

/// Settings, the later of which take precedence over the earlier ones, and assignments over texts.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    /// A section (`[metric…]`) in a text replaces that section of the earlier ones completely; what it does not set has
    /// the default.
    pub texts: Vec<Text>,
    /// Each changes one setting.
    pub assignments: Vec<Assignment>,
}

/// A configuration, and where each part of it comes from.
#[derive(Clone, Debug)]
pub struct Layered {
    /// The configuration.
    pub config: PipelineConfig,
    /// A section or a setting, and the layer that set it; later entries take precedence.
    origins: Vec<(String, String)>,
}

impl Layers {
    /// Combines the layers.
    ///
    /// # Errors
    /// A text or an assignment is wrong, or the combination contradicts itself.
    ///
    /// # Examples
    /// ```
    /// use congruent_settings::{Assignment, Layers};
    ///
    /// let change = |text: &str| Assignment { name: format!("--set {text}"), text: text.to_owned() };
    /// let layers = |text: &str| Layers { assignments: vec![change(text)], ..Layers::default() };
    /// assert_eq!(layers("seed=7").resolve()?.config.seed, 7);
    /// let error = layers("metirc=mse").resolve().unwrap_err().to_string();
    /// assert!(error.contains("--set metirc=mse") && error.contains("did you mean `metric`?"), "{error}");
    /// # Ok::<(), congruent_settings::SettingsError>(())
    /// ```
    pub fn resolve(&self) -> Result<Layered, SettingsError> {
        let mut sections = toml::Table::new();
        let mut origins = Vec::new();
        for Text { name, toml } in &self.texts {
            parse(toml, name)?;
            let table = toml::from_str::<toml::Table>(toml);
            for (section, value) in table.map_err(|error| SettingsError(format!("{name}: {error}")))? {
                origins.push((section.clone(), name.clone()));
                sections.insert(section, value);
            }
        }
        let mut config =
            PipelineConfig::deserialize(sections).map_err(|error| SettingsError(error.message().to_owned()))?;
        for Assignment { name, text } in &self.assignments {
            let before = all_settings(&config)?;
            let changed = assigned(&config, text);
            config = changed.map_err(|SettingsError(reason)| SettingsError(format!("{name}: {reason}")))?;
            // If another member was chosen, the rest of its settings are defaults.
            let new = all_settings(&config)?.into_keys().filter(|key| !before.contains_key(key));
            origins.extend(new.map(|key| (key, DEFAULT.to_owned())));
            let key = text.split('=').next().unwrap_or_default().trim();
            origins.push((key.to_owned(), name.clone()));
        }
        match config.contradiction() {
            Some(contradiction) => Err(SettingsError(contradiction.to_string())),
            None => Ok(Layered { config, origins }),
        }
    }
}

impl Layered {
    /// Replaces the seed, which here may also be a number that TOML does not have; `name` is what messages call it.
    #[must_use]
    pub fn with_seed(mut self, seed: u64, name: &str) -> Layered {
        self.config.seed = seed;
        self.origins.push(("seed".to_owned(), name.to_owned()));
        self
    }

    /// Returns every setting with its origin, one per line.
    ///
    /// # Errors
    /// The configuration cannot be written as TOML.
    pub fn explained(&self) -> Result<String, SettingsError> {
        let settings = all_settings(&self.config)?;
        let width = settings.iter().map(|(key, value)| key.len() + value.len() + 3).max().unwrap_or_default().min(70);
        let line = |(key, value): (&String, &String)| {
            let setting = format!("{key} = {value}");
            format!("{setting:width$}  # {}", self.origin(key))
        };
        Ok(settings.iter().map(line).collect::<Vec<_>>().join("\n"))
    }

    fn origin(&self, key: &str) -> &str {
        let settles = |part: &str| key.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        self.origins.iter().rev().find(|(part, _)| settles(part)).map_or(DEFAULT, |(_, origin)| origin)
    }
}

/// Returns every setting as TOML, by its full name.
///
/// # Errors
/// The configuration cannot be written as TOML.
pub fn all_settings(config: &PipelineConfig) -> Result<BTreeMap<String, String>, SettingsError> {
    let mut settings = BTreeMap::new();
    flatten("", &toml::Value::Table(table_of(config)?), &mut settings);
    Ok(settings)
}

fn flatten(key: &str, value: &toml::Value, settings: &mut BTreeMap<String, String>) {
    match value {
        toml::Value::Table(table) if !table.is_empty() => {
            for (name, inner) in table {
                let path = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                flatten(&path, inner, settings);
            }
        }
        other => {
            settings.insert(key.to_owned(), other.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_pipeline::Preset;

    fn text(preset: Preset) -> Text {
        Text { name: format!("preset {}", preset.name()), toml: preset.toml().to_owned() }
    }

    #[test]
    fn a_lone_layer_means_what_its_text_means() {
        for preset in Preset::ALL {
            let layers = Layers { texts: vec![text(preset)], ..Layers::default() };
            assert_eq!(layers.resolve().unwrap().config, parse(preset.toml(), "preset").unwrap());
        }
    }

    #[test]
    fn another_member_has_nothing_of_the_one_before() {
        let change = "detector.iss.salient-radius=5pr".to_owned();
        let assignments = vec![Assignment { name: format!("--set {change}"), text: change }];
        let layered = Layers { texts: vec![text(Preset::Paper)], assignments }.resolve().unwrap();
        let text = layered.explained().unwrap();
        let origins = text.lines().filter(|line| line.starts_with("detector."));
        let origins: Vec<&str> = origins.map(|line| line.split("# ").nth(1).unwrap()).collect();
        assert!(origins.len() > 2, "{text}");
        assert_eq!(origins.iter().filter(|origin| **origin == "default").count(), origins.len() - 1, "{text}");
        assert!(origins.contains(&"--set detector.iss.salient-radius=5pr"), "{text}");
    }
}
