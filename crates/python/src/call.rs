//! What a caller asks for besides the scans: settings, what is known of the pose, threads.

use crate::arrays::{pose, three};
use congruent_geometry::Length;
use congruent_pipeline::{Guess, MAX_TILT, PipelineConfig, Preset, Prior, tilt};
use congruent_settings::{Assignment, Layers, SettingsError, Text, preset};
use nalgebra::{Unit, Vector3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Combines a preset's name or a text of TOML with single settings and a seed.
pub(crate) fn config(
    config: &str,
    settings: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
) -> PyResult<PipelineConfig> {
    // A text of settings has an equals sign or a section.
    let is_name = Preset::named(config).is_some() || !config.contains(['=', '[', '\n']);
    let text = if is_name {
        Text { name: format!("preset {config}"), toml: preset(config).map_err(refused)?.to_owned() }
    } else {
        Text { name: "config".to_owned(), toml: config.to_owned() }
    };
    let mut layers = Layers { texts: vec![text], assignments: Vec::new() };
    for (key, value) in settings.into_iter().flat_map(|settings| settings.iter()) {
        let (key, value) = (key.extract::<String>()?, written(&value)?);
        layers.assignments.push(Assignment { name: format!("settings['{key}']"), text: format!("{key}={value}") });
    }
    let layered = layers.resolve().map_err(refused)?;
    Ok(match seed {
        Some(seed) => layered.with_seed(seed, "seed").config,
        None => layered.config,
    })
}

/// Returns a value as TOML.
fn written(value: &Bound<'_, PyAny>) -> PyResult<String> {
    match value.extract::<bool>() {
        Ok(value) => Ok(value.to_string()),
        Err(_) => Ok(value.str()?.to_string()),
    }
}

fn refused(error: SettingsError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Combines what is known of the pose; angles in degrees.
pub(crate) fn prior(
    init: Option<&Bound<'_, PyAny>>,
    max_rotation: Option<f64>,
    max_translation: Option<&str>,
    up: Option<&Bound<'_, PyAny>>,
) -> PyResult<Prior> {
    if init.is_none() && (max_rotation.is_some() || max_translation.is_some()) {
        return Err(PyValueError::new_err("max_rotation and max_translation are bounds around init; give init, too"));
    }
    if let Some(degrees) = max_rotation.filter(|degrees| !(0.0..=180.0).contains(degrees)) {
        return Err(PyValueError::new_err(format!("max_rotation: {degrees} is not an angle of 0 to 180 degrees")));
    }
    let length =
        |text: &str| text.parse::<Length>().map_err(|e| PyValueError::new_err(format!("max_translation: {e}")));
    let guess = match init {
        None => None,
        Some(init) => Some(Guess {
            target_from_source: pose(init, "init")?,
            max_rotation: max_rotation.map(f64::to_radians),
            max_translation: max_translation.map(length).transpose()?,
        }),
    };
    let direction = |given: &Bound<'_, PyAny>| {
        let up = three(given, "up")?;
        Unit::try_new(Vector3::from(up), 1e-9)
            .filter(|up| up.iter().all(|v| v.is_finite()))
            .ok_or_else(|| PyValueError::new_err(format!("up: {up:?} is not a direction")))
    };
    let up = up.map(direction).transpose()?;
    if let Some(tilt) = guess.as_ref().map(|guess| tilt(&guess.target_from_source, up)).filter(|tilt| *tilt > MAX_TILT)
    {
        let (tilt, most) = (tilt.to_degrees(), MAX_TILT.to_degrees());
        let message = format!("init: tilts the source by {tilt:.1} degrees, but with up at most {most:.1} are allowed");
        return Err(PyValueError::new_err(message));
    }
    Ok(Prior { guess, up })
}

/// Runs work on so many threads (all of the machine by default), without holding the interpreter.
pub(crate) fn on_threads<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    if threads == Some(0) {
        return Err(PyValueError::new_err("threads: at least 1; None takes all of the machine"));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = pool.map_err(|error| PyValueError::new_err(format!("threads: {error}")))?;
    Ok(py.detach(|| pool.install(work)))
}
