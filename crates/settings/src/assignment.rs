//! One setting changed.

use crate::SettingsError;
use crate::words::with_suggestion;
use congruent_pipeline::PipelineConfig;
use serde::Deserialize;

/// Settings that choose a member of a family; naming another member replaces the previous one.
pub const FAMILIES: [&str; 12] = [
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

/// Returns the configuration with one `key.path=value` applied.
pub(crate) fn assigned(config: &PipelineConfig, assignment: &str) -> Result<PipelineConfig, SettingsError> {
    let Some((path, value)) = assignment.split_once('=') else {
        return Err(SettingsError("write KEY=VALUE, e.g. metric.mse.threshold=5pr".to_owned()));
    };
    let mut table = table_of(config)?;
    let keys: Vec<&str> = path.trim().split('.').collect();
    assign(&mut table, &keys, 0, value_of(value.trim()))?;
    PipelineConfig::deserialize(table).map_err(|error| SettingsError(with_suggestion(error.message())))
}

/// Returns the configuration as a table, with every setting.
pub(crate) fn table_of(config: &PipelineConfig) -> Result<toml::Table, SettingsError> {
    let failed = |error| SettingsError(format!("the configuration cannot be written as TOML: {error}"));
    toml::Table::try_from(config).map_err(failed)
}

/// Parses a TOML value. Text that is not TOML becomes a string, so that `5pr` needs no quotes.
fn value_of(text: &str) -> toml::Value {
    let parsed: Option<toml::Table> = toml::from_str(&format!("value = {text}")).ok();
    parsed.and_then(|mut t| t.remove("value")).unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

fn assign(table: &mut toml::Table, keys: &[&str], depth: usize, value: toml::Value) -> Result<(), SettingsError> {
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
        return Err(SettingsError(format!("{} has no settings inside it", keys[..=depth].join("."))));
    };
    if is_family && !inner.contains_key(keys[depth + 1]) {
        inner.clear();
    }
    assign(inner, keys, depth + 1, value)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
