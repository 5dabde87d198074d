//! Names of metrics and estimators in tables.

use congruent_estimators::EstimatorConfig;
use congruent_metrics::MetricConfig;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::borrow::Cow;
use toml::{Table, Value};

/// Returns the name of a metric, with the settings that differ from their defaults, except the threshold, which the
/// plan varies.
#[must_use]
pub(super) fn metric_label(metric: &MetricConfig) -> Cow<'static, str> {
    label(metric_name(metric), metric, "threshold")
}

/// Returns the name of an estimator, with the settings that differ from their defaults, except the number of
/// iterations, which the plan varies.
#[must_use]
pub(super) fn estimator_label(estimator: &EstimatorConfig) -> Cow<'static, str> {
    label(estimator_name(estimator), estimator, "iterations")
}

fn label<T: Serialize + DeserializeOwned>(name: &'static str, member: &T, varied: &str) -> Cow<'static, str> {
    let mut unusual = unusual(member);
    unusual.remove(varied);
    if unusual.is_empty() {
        return name.into();
    }
    let settings: Vec<String> = unusual.iter().map(|(key, value)| format!("{key} {}", plain(value))).collect();
    format!("{name} ({})", settings.join(", ")).into()
}

/// Returns the settings of a metric or estimator that differ from their defaults.
pub(super) fn unusual<T: Serialize + DeserializeOwned>(member: &T) -> Table {
    let settings = |member: &T| -> Option<(String, Table)> {
        let table = Table::try_from(member).expect("settings can be written as TOML");
        table.into_iter().find_map(|(name, settings)| Some((name, settings.as_table()?.clone())))
    };
    let Some((name, own)) = settings(member) else { return Table::new() };
    let usual: T =
        Table::from_iter([(name, Value::Table(Table::new()))]).try_into().expect("every setting has a default");
    let (_, usual) = settings(&usual).expect("the same member");
    own.into_iter().filter(|(key, value)| usual.get(key) != Some(value)).collect()
}

/// Formats a value, text without quotation marks.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Returns the paper's name of a metric, or our own if it has none.
fn metric_name(metric: &MetricConfig) -> &'static str {
    match metric {
        MetricConfig::InlierCount(_) => "INLIER",
        MetricConfig::Mae(_) => "MAE",
        MetricConfig::Mse(_) => "MSE",
        MetricConfig::LogCosh(_) => "LOG-COSH",
        MetricConfig::Exp(_) => "EXP",
        MetricConfig::Quantile(_) => "QUANTILE",
        MetricConfig::NegQuantile(_) => "-QUANTILE",
        MetricConfig::Huber(_) => "Huber",
        MetricConfig::Msac(_) => "MSAC",
        MetricConfig::Magsac(_) => "MAGSAC",
        MetricConfig::SacIa(_) => "SAC-IA",
        MetricConfig::PointDistance(_) => "PC Dist",
        MetricConfig::OverlappedPoints(_) => "#OP",
        MetricConfig::SoftOverlap(_) => "soft overlap",
    }
}

/// Returns the paper's name of an estimator, or our own if it has none.
fn estimator_name(estimator: &EstimatorConfig) -> &'static str {
    match estimator {
        EstimatorConfig::Ransac(_) => "RANSAC",
        EstimatorConfig::TwoPoint(_) => "2SAC-GC",
        EstimatorConfig::OnePoint(_) => "1P-RANSAC",
        EstimatorConfig::SacIa(_) => "SAC-IA",
        EstimatorConfig::Pivots(_) => "pivots",
        EstimatorConfig::Seeds(_) => "SC2-PCR seeds",
        EstimatorConfig::Cliques(_) => "cliques",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_of_one_family_are_told_apart() {
        let estimator = |text: &str| estimator_label(&toml::from_str(text).unwrap());
        let metric = |text: &str| metric_label(&toml::from_str(text).unwrap());
        assert_eq!(estimator("ransac = { iterations = 50 }"), "RANSAC");
        assert_eq!(estimator("ransac = { min-spread = '15pr' }"), "RANSAC (min-spread 15pr)");
        assert_eq!(estimator("two-point = { angle-test = 'off' }"), "2SAC-GC (angle-test off)");
        assert_eq!(metric("inlier-count = { threshold = '1pr' }"), "INLIER");
        assert_eq!(metric("quantile = {}"), "QUANTILE");
    }
}
