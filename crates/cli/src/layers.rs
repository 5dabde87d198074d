//! Where settings come from: defaults < preset < the folder's `congruent.toml` < file < `--set`.

use crate::args::RunArgs;
use crate::configuration::{named_preset, readable};
use anyhow::Result;
use congruent_settings::{Assignment, Layered, Layers, Text, preset};
use std::path::Path;

/// The configuration file that is looked for in the folder of a batch.
pub(crate) const FOLDER_FILE: &str = "congruent.toml";

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

/// Combines the layers.
pub(crate) fn resolve(sources: &Sources<'_>) -> Result<Layered> {
    let folder_file = sources.folder.map(|folder| folder.join(FOLDER_FILE)).filter(|path| path.is_file());
    let mut layers = Layers::default();
    if let Some(name) = sources.preset {
        layers.texts.push(Text { name: format!("preset {name}"), toml: preset(name)?.to_owned() });
    }
    for path in [folder_file.as_deref(), sources.file].into_iter().flatten() {
        layers.texts.push(Text { name: path.display().to_string(), toml: readable(path)? });
    }
    let set = |text: &String| Assignment { name: format!("--set {text}"), text: text.clone() };
    layers.assignments.extend(sources.set.iter().map(set));
    let layered = layers.resolve()?;
    Ok(match sources.seed {
        Some(seed) => layered.with_seed(seed, "--seed"),
        None => layered,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
