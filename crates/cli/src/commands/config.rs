//! `congruent config`: shows presets and checks files.

use crate::args::ConfigCommand;
use crate::layers::{self, Sources};
use crate::{configuration, output};
use anyhow::{Result, bail};
use std::process::ExitCode;

pub(super) fn run(command: &ConfigCommand) -> Result<ExitCode> {
    match command {
        ConfigCommand::Show { preset, explain: false, .. } if preset == "members" => {
            output::data(configuration::MEMBERS.trim_end())?;
        }
        ConfigCommand::Show { preset, explain: false, .. } => {
            output::data(congruent_settings::preset(preset)?.trim_end())?;
        }
        ConfigCommand::Show { preset, explain: true, folder, config, set, seed } => {
            let named = Sources::named(config.as_deref());
            let preset = one_preset(preset, named.preset)?;
            let sources = Sources { preset, folder: folder.as_deref(), set, seed: *seed, ..named };
            output::data(&layers::resolve(&sources)?.explained()?)?;
        }
        ConfigCommand::Check { file } => {
            layers::resolve(&Sources::named(Some(file)))?;
            output::data(&format!("{}: ok", file.display()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the preset of which settings are explained; `configured` is the one that `--config` names.
fn one_preset<'a>(shown: &'a str, configured: Option<&'a str>) -> Result<Option<&'a str>> {
    match (shown, configured) {
        ("members", _) => bail!(
            "`members` lists every member at its defaults, so there is nothing to explain; leave out --explain, or name a \
             preset: default, fast, paper"
        ),
        // The preset `default` applies anyway.
        ("default", configured) => Ok(configured),
        (shown, Some(configured)) if shown != configured => {
            bail!("two presets are named, `{shown}` and -c {configured}; leave out one")
        }
        (shown, _) => Ok(Some(shown)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_preset_is_explained() {
        let of = |shown, configured| one_preset(shown, configured).map_err(|error| error.to_string());
        assert_eq!(of("default", None), Ok(None));
        assert_eq!(of("default", Some("paper")), Ok(Some("paper")));
        assert_eq!(of("paper", None), Ok(Some("paper")));
        assert_eq!(of("paper", Some("paper")), Ok(Some("paper")));
        assert!(of("fast", Some("paper")).unwrap_err().contains("`fast` and -c paper"));
        assert!(of("members", None).unwrap_err().contains("leave out --explain"));
    }
}
