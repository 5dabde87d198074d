//! Texts that are configurations.

use crate::SettingsError;
use crate::words::{suggestion, with_suggestion};
use congruent_pipeline::{PipelineConfig, Preset};

/// Returns the text of a preset.
///
/// # Errors
/// There is no preset of this name; the message lists all.
pub fn preset(name: &str) -> Result<&'static str, SettingsError> {
    Preset::named(name).map(Preset::toml).ok_or_else(|| {
        let names = Preset::ALL.map(Preset::name);
        SettingsError(format!(
            "there is no preset '{name}'{}; there are: {}",
            suggestion(name, &names),
            names.join(", ")
        ))
    })
}

/// Parses TOML; errors refer to it as `name`.
///
/// # Errors
/// The text is no TOML, or has settings that do not exist or values that they cannot have.
pub fn parse(text: &str, name: &str) -> Result<PipelineConfig, SettingsError> {
    toml::from_str(text).map_err(|error| {
        let place = error.span().map_or(String::new(), |span| {
            let (line, column) = line_and_column(text, span.start);
            format!(":{line}:{column}")
        });
        SettingsError(format!("{name}{place}: {}", with_suggestion(error.message())))
    })
}

/// Returns the line and column of a byte offset, counted from 1.
fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    (before.matches('\n').count() + 1, before.rsplit('\n').next().unwrap_or_default().chars().count() + 1)
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
}
