//! Turns TOML and `--set` into a configuration; errors name the place and the nearest valid name.

use crate::args::RunArgs;
use crate::layers::{self, Sources};
use anyhow::{Context, Result, anyhow, bail};
use congruent_pipeline::{PipelineConfig, Preset};
use serde::Deserialize;
use std::path::Path;

/// What `config show members` prints: every member of every family.
pub(crate) const MEMBERS: &str = include_str!("../../../configs/members.toml");

/// Settings that choose a member of a family; naming another member replaces the previous one.
const FAMILIES: [&str; 12] = [
    "sampling",
    "normals.neighborhood",
    "normals.orientation",
    "detector",
    "descriptor",
    "frame",
    "matcher",
    "estimator",
    "metric",
    "ranking",
    "refinement",
    "verdict",
];

/// Returns the text of a preset.
pub(crate) fn preset(name: &str) -> Result<&'static str> {
    Preset::named(name).map(Preset::toml).ok_or_else(|| {
        let names = Preset::ALL.map(Preset::name);
        anyhow!("there is no preset '{name}'{}; there are: {}", suggestion(name, &names), names.join(", "))
    })
}

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

/// Parses TOML; errors refer to it as `name`.
pub(crate) fn parse(text: &str, name: &str) -> Result<PipelineConfig> {
    toml::from_str(text).map_err(|error| {
        let place = error.span().map_or(String::new(), |span| {
            let (line, column) = line_and_column(text, span.start);
            format!(":{line}:{column}")
        });
        anyhow!("{name}{place}: {}", with_suggestion(error.message()))
    })
}

/// Returns the line and column of a byte offset, counted from 1.
fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    (before.matches('\n').count() + 1, before.rsplit('\n').next().unwrap_or_default().chars().count() + 1)
}

/// Returns the configuration with one `key.path=value` applied.
pub(crate) fn assigned(config: &PipelineConfig, assignment: &str) -> Result<PipelineConfig> {
    let Some((path, value)) = assignment.split_once('=') else {
        bail!("write KEY=VALUE, e.g. metric.mse.threshold=5pr");
    };
    let mut table = toml::Table::try_from(config).context("the configuration cannot be written as TOML")?;
    let keys: Vec<&str> = path.trim().split('.').collect();
    assign(&mut table, &keys, 0, value_of(value.trim()))?;
    PipelineConfig::deserialize(table).map_err(|error| anyhow!(with_suggestion(error.message())))
}

/// Parses a TOML value. Text that is not TOML becomes a string, so that `5pr` needs no quotes.
fn value_of(text: &str) -> toml::Value {
    let parsed: Option<toml::Table> = toml::from_str(&format!("value = {text}")).ok();
    parsed.and_then(|mut t| t.remove("value")).unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

fn assign(table: &mut toml::Table, keys: &[&str], depth: usize, value: toml::Value) -> Result<()> {
    let is_family = FAMILIES.contains(&keys[..=depth].join(".").as_str());
    let key = keys[depth];
    if depth + 1 == keys.len() {
        // A family accepts the bare name of a member.
        let value = match value {
            toml::Value::String(member) if is_family => {
                toml::Value::Table([(member, toml::Table::new().into())].into_iter().collect())
            }
            other => other,
        };
        table.insert(key.to_owned(), value);
        return Ok(());
    }
    let entry = table.entry(key).or_insert_with(|| toml::Table::new().into());
    let Some(inner) = entry.as_table_mut() else {
        bail!("{} has no settings inside it", keys[..=depth].join("."));
    };
    if is_family && !inner.contains_key(keys[depth + 1]) {
        inner.clear();
    }
    assign(inner, keys, depth + 1, value)
}

/// Phrases of serde, and what the user reads instead.
const WORDS: [(&str, &str); 5] = [
    ("wanted exactly 1 element, more than 1 element", "two members of one family; keep only one of their tables"),
    ("expected u64", "expected a whole number, 0 or above"),
    ("expected usize", "expected a whole number, 0 or above"),
    ("expected f64", "expected a number"),
    ("invalid type: unit variant, expected newtype variant", "a member is a table of settings: write { NAME = {} }"),
];
/// What serde puts before the name of a type of ours.
const STRUCT: &str = "expected struct ";

/// Adds the nearest valid name to serde's message about an unknown one, and rephrases messages for the user.
fn with_suggestion(message: &str) -> String {
    let message = WORDS.iter().fold(message.trim().to_owned(), |said, (serde, user)| said.replace(serde, user));
    let message = match message.split_once(STRUCT) {
        Some((before, _)) => format!("{before}expected a table of settings"),
        None => message,
    };
    let message = message.as_str();
    let mut names = message.split('`').skip(1).step_by(2);
    match names.next() {
        Some(unknown) if message.starts_with("unknown ") => {
            let valid: Vec<&str> = names.collect();
            format!("{message}{}", suggestion(unknown, &valid))
        }
        _ => message.to_owned(),
    }
}

fn suggestion(unknown: &str, valid: &[&str]) -> String {
    let unknown = &unknown.to_lowercase();
    let nearest = valid.iter().map(|name| (strsim::damerau_levenshtein(unknown, name), name)).min();
    match nearest {
        Some((distance, name)) if distance <= unknown.chars().count().div_ceil(2) => {
            format!("; did you mean `{name}`?")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_said_in_words_of_the_configuration() {
        for (text, expected) in [
            ("[metric.mse]\n[metric.mae]\n", "two members of one family"),
            ("seed = -1\n", "a whole number, 0 or above"),
            ("[pool]\nposes = 1.5\n", "a whole number, 0 or above"),
            ("[metric.MSE]\n", "did you mean `mse`"),
            ("metric = 'mse'\n", "write { NAME = {} }"),
            ("[detector]\nuniform = '4pr'\n", "invalid type: string \"4pr\", expected a table of settings"),
        ] {
            let said = parse(text, "x.toml").unwrap_err().to_string();
            assert!(said.contains(expected), "{said}");
        }
    }

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
    fn every_preset_is_valid_and_survives_the_round_trip() {
        for preset in Preset::ALL {
            let config = parse(preset.toml(), preset.name()).unwrap();
            let written = toml::to_string(&config).unwrap();
            assert_eq!(parse(&written, preset.name()).unwrap(), config, "{written}");
        }
    }

    #[test]
    fn mistakes_are_named_with_their_place_and_the_nearest_name() {
        for (text, expected) in [
            ("[metric.mse]\nthresold = \"5pr\"", ["my.toml:2:1", "`thresold`", "did you mean `threshold`?"]),
            ("[metric.mes]\n", ["my.toml:1:9", "`mes`", "did you mean `mse`?"]),
            ("[metirc.mse]\n", ["my.toml:1:2", "`metirc`", "did you mean `metric`?"]),
            ("seed = 1\n[metric.mse]\nthreshold = 7.5", ["my.toml:3:13", "7.5", "\"7.5pr\""]),
            ("[metric.mse]\nthreshold = \"7.5\"", ["my.toml:2:13", "'7.5'", "\"7.5pr\""]),
            ("[metric.mse]\nthreshold = \"-1pr\"", ["my.toml:2:13", "'-1pr'", "above zero"]),
            ("[estimator.ransac]\niterations = \"many\"", ["my.toml:2:14", "many", "whole number"]),
            ("[matcher.ratio]\nkeep = 1.5", ["my.toml:2:8", "1.5", "at most 1"]),
            ("[verdict.dense]\nmin-confidence = nan", ["my.toml:2:18", "NaN", "from 0 to 1"]),
            ("[verdict.a-contrario]\nmax-false-alarms = -1", ["my.toml:2:20", "-1", "above 0"]),
            ("[ranking.dense]\nmin-normal-cosine = 60", ["my.toml:2:21", "60", "from -1 to 1"]),
            ("[estimator.ransac.adaptive-stop]\nconfidence = 1.0", ["my.toml:2:14", "1", "from 0 to below 1"]),
            ("[refinement.gicp]\nflatness = 0", ["my.toml:2:12", "0", "above 0"]),
            ("seed = 1\nseed = 2", ["my.toml:2:1", "duplicate", "key"]),
            ("seed = ", ["my.toml:1:8", "", ""]),
        ] {
            let message = refused(text);
            assert!(expected.iter().all(|part| message.contains(part)), "{text:?} gave {message}");
        }
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
    fn naming_a_member_replaces_the_one_before() {
        for assignment in [
            "sampling=none",
            "normals.neighborhood.nearest=20",
            "normals.orientation=outward",
            "detector=iss",
            "descriptor=lfsh",
            "frame=shot",
            "matcher=nearest",
            "estimator=one-point",
            "metric=mae",
            "ranking=none",
            "refinement=none",
            "verdict=a-contrario",
        ] {
            let family = assignment.split('=').next().unwrap_or_default().trim_end_matches(".nearest");
            assert!(FAMILIES.contains(&family), "{family}");
            let changed = assigned(&PipelineConfig::default(), assignment).unwrap();
            assert_ne!(changed, PipelineConfig::default(), "{assignment}");
        }
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
