//! `congruent config`: presets shown, files checked.

use crate::args::ConfigCommand;
use crate::{configuration, output};
use anyhow::Result;
use std::process::ExitCode;

pub(super) fn run(command: &ConfigCommand) -> Result<ExitCode> {
    match command {
        ConfigCommand::Show { preset } if preset == "members" => output::data(configuration::MEMBERS.trim_end()),
        ConfigCommand::Show { preset } => output::data(configuration::preset(preset)?.trim_end()),
        ConfigCommand::Check { file } => {
            configuration::read(file)?;
            output::data(&format!("{}: ok", file.display()));
        }
    }
    Ok(ExitCode::SUCCESS)
}
