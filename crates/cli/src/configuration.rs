//! The configuration that a command line describes, and the files that it names.

use crate::args::RunArgs;
use crate::layers::{self, Sources};
use anyhow::{Result, anyhow};
use congruent_pipeline::{PipelineConfig, Preset};
use std::path::Path;

/// What `config show members` prints: every member of every family.
pub(crate) const MEMBERS: &str = include_str!("../../../configs/members.toml");

/// Returns the configuration that the command line describes.
pub(crate) fn resolve(args: &RunArgs) -> Result<PipelineConfig> {
    Ok(layers::resolve(&Sources::of_run(args, None))?.config)
}

/// Returns the preset that a path names if there is no such file.
pub(crate) fn named_preset(path: &Path) -> Option<&'static str> {
    let name = path.to_string_lossy();
    Preset::named(&name).filter(|_| !path.is_file()).map(Preset::name)
}

/// Reads the text of a configuration file.
pub(crate) fn readable(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|error| {
        let names = Preset::ALL.map(Preset::name).join(", ");
        anyhow!("{}: cannot read the configuration: {error}; give a TOML file or a preset ({names})", path.display())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_settings::{FAMILIES, parse};

    /// Returns the tables of the list of members, each as a configuration of its own.
    fn members() -> Vec<String> {
        let mut tables: Vec<String> = Vec::new();
        for line in MEMBERS.lines().filter(|line| !line.starts_with('#')) {
            if line.starts_with('[') {
                tables.push(String::new());
            }
            if let Some(table) = tables.last_mut() {
                *table += &format!("{line}\n");
            }
        }
        tables
    }

    #[test]
    fn every_member_is_shown_at_its_defaults() {
        for table in members() {
            let header = table.lines().next().unwrap();
            assert_eq!(parse(&table, "members").unwrap(), parse(header, "members").unwrap(), "{table}");
        }
    }

    #[test]
    fn no_member_is_left_out() {
        for family in FAMILIES {
            let refused = refused(&format!("[{family}.nothing]"));
            let listed: Vec<&str> = refused.split('`').skip(3).step_by(2).collect();
            assert!(listed.len() > 1, "{refused}");
            for member in listed {
                let inline = family.split('.').next_back().unwrap().to_owned() + &format!(" = {{ {member} = ");
                let is_shown = MEMBERS.contains(&format!("[{family}.{member}]")) || MEMBERS.contains(&inline);
                assert!(is_shown, "[{family}.{member}] is not shown");
            }
        }
    }

    fn refused(text: &str) -> String {
        parse(text, "my.toml").unwrap_err().to_string()
    }

    #[test]
    fn settings_are_changed_one_by_one() {
        let set = |assignments: &[&str]| {
            resolve(&RunArgs { set: assignments.iter().map(|s| (*s).to_owned()).collect(), ..RunArgs::default() })
        };
        let written = |assignments: &[&str]| parse(&assignments.join("\n"), "expected").unwrap();
        assert_eq!(set(&["metric.mse.threshold=5pr"]).unwrap(), written(&["metric.mse.threshold='5pr'"]));
        assert_eq!(set(&["metric=inlier-count"]).unwrap(), written(&["metric.inlier-count={}"]));
        assert_eq!(set(&["metric.mae.threshold=3pr"]).unwrap(), written(&["metric.mae.threshold='3pr'"]));
        assert_eq!(
            set(&["seed=7", "estimator.ransac.iterations = 50"]).unwrap(),
            written(&["seed=7", "estimator.ransac.iterations=50"])
        );
        assert_eq!(
            set(&["normals.orientation.viewpoint.at=[0,0,1.5]"]).unwrap(),
            written(&["normals.orientation.viewpoint.at=[0.0,0.0,1.5]"])
        );
    }

    #[test]
    fn wrong_settings_are_refused_by_name() {
        for (assignment, expected) in [
            ("metric.mse.thresold=5pr", "did you mean `threshold`?"),
            ("metirc.mse.threshold=5pr", "did you mean `metric`?"),
            ("metric=msee", "did you mean `mse`?"),
            ("metric.mse.threshold=5", "\"7.5pr\""),
            ("seed", "KEY=VALUE"),
            ("seed.x=1", "seed has no settings inside it"),
        ] {
            let args = RunArgs { set: vec![assignment.to_owned()], ..RunArgs::default() };
            let message = format!("{:#}", resolve(&args).unwrap_err());
            assert!(message.contains(expected) && message.contains(assignment), "{assignment} gave {message}");
        }
    }

    #[test]
    fn a_verdict_that_cannot_be_had_is_refused() {
        let set = |all: &[&str]| RunArgs { set: all.iter().map(ToString::to_string).collect(), ..RunArgs::default() };
        let message = resolve(&set(&["ranking=none"])).unwrap_err().to_string();
        assert!(message.contains("choose verdict=a-contrario"), "{message}");
        assert!(resolve(&set(&["ranking=none", "verdict=a-contrario"])).is_ok());
    }
}
