//! Where settings come from: defaults < preset < the folder's `congruent.toml` < file < `--set`.
//!
//! A section (`[metric…]`) in a file replaces that section of the earlier layers completely; what it does not set has
//! the default. `--set` changes one setting.

use crate::args::RunArgs;
use crate::configuration::{assigned, named_preset, parse, preset, readable};
use anyhow::{Context, Result, anyhow};
use congruent_pipeline::PipelineConfig;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The configuration file that is looked for in the folder of a batch.
pub(crate) const FOLDER_FILE: &str = "congruent.toml";

/// The origin of settings that no layer sets.
const DEFAULT: &str = "default";

/// The layers that a command line names.
#[derive(Default)]
pub(crate) struct Sources<'a> {
    pub(crate) preset: Option<&'a str>,
    pub(crate) folder: Option<&'a Path>,
    pub(crate) file: Option<&'a Path>,
    pub(crate) set: &'a [String],
    pub(crate) seed: Option<u64>,
}

impl<'a> Sources<'a> {
    /// Interprets a path: a file, or the preset of that name if there is no such file.
    pub(crate) fn named(path: Option<&'a Path>) -> Sources<'a> {
        let preset = path.and_then(named_preset);
        Sources { preset, file: path.filter(|_| preset.is_none()), ..Sources::default() }
    }

    pub(crate) fn of_run(args: &'a RunArgs, folder: Option<&'a Path>) -> Sources<'a> {
        Sources { folder, set: &args.set, seed: args.seed, ..Sources::named(args.config.as_deref()) }
    }
}

/// A configuration, and where each part of it comes from.
#[derive(Debug)]
pub(crate) struct Layered {
    pub(crate) config: PipelineConfig,
    /// A section or a setting, and the layer that set it; later entries take precedence.
    origins: Vec<(String, String)>,
}

/// Combines the layers.
pub(crate) fn resolve(sources: &Sources<'_>) -> Result<Layered> {
    let folder_file = sources.folder.map(|folder| folder.join(FOLDER_FILE)).filter(|path| path.is_file());
    let mut texts: Vec<(String, String)> = Vec::new();
    if let Some(name) = sources.preset {
        texts.push((format!("preset {name}"), preset(name)?.to_owned()));
    }
    for path in [folder_file.as_deref(), sources.file].into_iter().flatten() {
        texts.push((path.display().to_string(), readable(path)?));
    }
    let mut sections = toml::Table::new();
    let mut origins = Vec::new();
    for (name, text) in &texts {
        parse(text, name)?;
        for (section, value) in toml::from_str::<toml::Table>(text).with_context(|| name.clone())? {
            origins.push((section.clone(), name.clone()));
            sections.insert(section, value);
        }
    }
    let mut config = PipelineConfig::deserialize(sections).map_err(|error| anyhow!("{}", error.message()))?;
    for assignment in sources.set {
        let before = all_settings(&config)?;
        config = assigned(&config, assignment).with_context(|| format!("--set {assignment}"))?;
        // If another member was chosen, the rest of its settings are defaults.
        let new = all_settings(&config)?.into_keys().filter(|key| !before.contains_key(key));
        origins.extend(new.map(|key| (key, DEFAULT.to_owned())));
        let key = assignment.split('=').next().unwrap_or_default().trim();
        origins.push((key.to_owned(), format!("--set {assignment}")));
    }
    if let Some(seed) = sources.seed {
        config.seed = seed;
        origins.push(("seed".to_owned(), "--seed".to_owned()));
    }
    match config.contradiction() {
        Some(contradiction) => Err(anyhow!("{contradiction}")),
        None => Ok(Layered { config, origins }),
    }
}

impl Layered {
    /// Returns every setting with its origin, one per line.
    pub(crate) fn explained(&self) -> Result<String> {
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
pub(crate) fn all_settings(config: &PipelineConfig) -> Result<BTreeMap<String, String>> {
    let table = toml::Table::try_from(config).context("the configuration cannot be written as TOML")?;
    let mut settings = BTreeMap::new();
    flatten("", &toml::Value::Table(table), &mut settings);
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

    #[test]
    fn a_lone_layer_means_what_its_text_means() {
        for (name, text) in Preset::ALL.map(|preset| (preset.name(), preset.toml())) {
            let layered = resolve(&Sources { preset: Some(name), ..Sources::default() }).unwrap();
            assert_eq!(layered.config, parse(text, name).unwrap());
        }
    }

    #[test]
    fn another_member_has_nothing_of_the_one_before() {
        let set = ["detector.iss.salient-radius=5pr".to_owned()];
        let layered = resolve(&Sources { preset: Some("paper"), set: &set, ..Sources::default() }).unwrap();
        let text = layered.explained().unwrap();
        let origins = text.lines().filter(|line| line.starts_with("detector."));
        let origins: Vec<&str> = origins.map(|line| line.split("# ").nth(1).unwrap()).collect();
        assert!(origins.len() > 2, "{text}");
        assert_eq!(origins.iter().filter(|origin| **origin == "default").count(), origins.len() - 1, "{text}");
        assert!(origins.contains(&"--set detector.iss.salient-radius=5pr"), "{text}");
    }

    #[test]
    fn later_layers_come_before_earlier_ones() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        write(FOLDER_FILE, "seed = 1\n[metric.mae]\nthreshold = \"3pr\"\n");
        let file = write("mine.toml", "seed = 2\n");
        let set = ["support.min-points=4".to_owned()];
        let sources =
            Sources { preset: Some("paper"), folder: Some(folder.path()), file: Some(&file), set: &set, seed: None };
        let layered = resolve(&sources).unwrap();
        let text = layered.explained().unwrap();
        let origin = |setting: &str| {
            let line = text.lines().find(|line| line.starts_with(setting)).unwrap();
            line.split("# ").nth(1).unwrap().to_owned()
        };
        assert_eq!(layered.config.seed, 2);
        assert!(origin("seed = 2").ends_with("mine.toml"));
        assert!(origin("metric.mae.threshold = \"3pr\"").ends_with(FOLDER_FILE));
        assert_eq!(origin("support.min-points = 4"), "--set support.min-points=4");
        assert_eq!(origin("sampling.voxel-grid.leaf"), "preset paper");
        write(FOLDER_FILE, "sed = 1\n");
        let message = resolve(&Sources { folder: Some(folder.path()), ..Sources::default() }).unwrap_err().to_string();
        assert!(message.contains("congruent.toml:1:1"), "{message}");
    }
}
