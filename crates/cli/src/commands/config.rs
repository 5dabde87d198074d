//! `congruent config`: shows presets and checks files.

use crate::args::ConfigCommand;
use crate::layers::{self, Sources};
use crate::{configuration, output};
use anyhow::Result;
use std::process::ExitCode;

pub(super) fn run(command: &ConfigCommand) -> Result<ExitCode> {
    match command {
        ConfigCommand::Show { preset, .. } if preset == "members" => output::data(configuration::MEMBERS.trim_end())?,
        ConfigCommand::Show { preset, explain: false, .. } => {
            output::data(configuration::preset(preset)?.trim_end())?;
        }
        ConfigCommand::Show { preset, explain: true, folder, config, set, seed } => {
            // The preset `default` applies anyway.
            let preset = Some(preset.as_str()).filter(|name| *name != "default");
            let (folder, file) = (folder.as_deref(), config.as_deref());
            let sources = Sources { preset, folder, file, set, seed: *seed };
            output::data(&layers::resolve(&sources)?.explained()?)?;
        }
        ConfigCommand::Check { file } => {
            layers::resolve(&Sources::named(Some(file)))?;
            output::data(&format!("{}: ok", file.display()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
