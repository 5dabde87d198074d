//! The registration of two scans.

use crate::arrays::{array, matrix};
use crate::call::{config, on_threads, prior};
use crate::scan::Given;
use congruent_geometry::Scan;
use congruent_pipeline::{Agreement, Fit, Pair, refine_traced, register_within};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// The pose that was found, and whether it can be trusted.
#[pyclass(frozen, module = "congruent")]
pub(crate) struct Registration {
    found: congruent_pipeline::Registration,
}

#[pymethods]
impl Registration {
    #[getter]
    fn verdict(&self) -> &'static str {
        self.found.verdict().name()
    }

    #[getter]
    fn confidence(&self) -> f64 {
        self.found.confidence()
    }

    #[getter]
    fn reason(&self) -> Option<String> {
        self.found.reason()
    }

    #[getter]
    fn target_from_source<'py>(&self, py: Python<'py>) -> Option<Matrix<'py>> {
        self.found.pose().map(|pose| matrix(py, pose))
    }

    #[getter]
    fn alternatives<'py>(&self, py: Python<'py>) -> Vec<Matrix<'py>> {
        self.found.alternatives().iter().map(|other| matrix(py, &other.target_from_source)).collect()
    }

    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Option<Matrix<'py>> {
        let known = self.found.uncertainty()?;
        let rows: [[f64; 6]; 6] = std::array::from_fn(|row| std::array::from_fn(|col| known.covariance[(row, col)]));
        Some(array(py, &rows))
    }

    #[getter]
    fn covariance_about(&self) -> Option<[f64; 3]> {
        self.found.uncertainty().map(|known| known.about.into())
    }

    #[getter]
    fn overlap(&self) -> Option<f64> {
        self.agreement().map(|agreement| agreement.overlap)
    }

    #[getter]
    fn contradicted(&self) -> Option<f64> {
        self.agreement().map(|agreement| agreement.hover + agreement.occlusion)
    }

    #[getter]
    fn correspondences(&self) -> usize {
        self.found.counts.correspondences
    }

    #[getter]
    fn inliers(&self) -> usize {
        self.found.counts.inliers
    }

    #[getter(resolution)]
    fn resolution_as_scanned(&self) -> f64 {
        self.found.raw_resolution
    }

    #[getter]
    fn timings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let timings = PyDict::new(py);
        for timed in &self.found.timings {
            timings.set_item(timed.stage.name(), timed.time.as_secs_f64())?;
        }
        Ok(timings)
    }

    fn __repr__(&self) -> String {
        let reason = self.found.reason().map_or_else(String::new, |reason| format!(": {reason}"));
        format!("<congruent.Registration {}, confidence {:.3}{reason}>", self.verdict(), self.confidence())
    }
}

impl Registration {
    fn agreement(&self) -> Option<&Agreement> {
        self.found.fit().map(|Fit { agreement, .. }| agreement)
    }
}

/// Registers two scans.
#[pyfunction]
#[pyo3(signature = (
    source, target, config="default", *, settings=None, seed=None, init=None, max_rotation=None, max_translation=None,
    up=None, threads=None,
))]
#[expect(clippy::too_many_arguments, reason = "named arguments of Python")]
pub(crate) fn register(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    target: &Bound<'_, PyAny>,
    config: &str,
    settings: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
    init: Option<&Bound<'_, PyAny>>,
    max_rotation: Option<f64>,
    max_translation: Option<&str>,
    up: Option<&Bound<'_, PyAny>>,
    threads: Option<usize>,
) -> PyResult<Registration> {
    let config = self::config(config, settings, seed)?;
    let prior = prior(init, max_rotation, max_translation, up)?;
    let scans = Pair { source: Given::new(source, "source")?, target: Given::new(target, "target")? };
    registered(py, threads, &scans, |source, target| register_within(source, target, &prior, &config))
}

/// Refines a rough pose without a search.
#[pyfunction]
#[pyo3(signature = (
    source, target, init, config="default", *, settings=None, seed=None, max_rotation=None, max_translation=None, up=None,
    threads=None,
))]
#[expect(clippy::too_many_arguments, reason = "named arguments of Python")]
pub(crate) fn refine(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    target: &Bound<'_, PyAny>,
    init: &Bound<'_, PyAny>,
    config: &str,
    settings: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
    max_rotation: Option<f64>,
    max_translation: Option<&str>,
    up: Option<&Bound<'_, PyAny>>,
    threads: Option<usize>,
) -> PyResult<Registration> {
    let config = self::config(config, settings, seed)?;
    let prior = prior(Some(init), max_rotation, max_translation, up)?;
    let guess = prior.guess.expect("a prior has the pose that it was made of");
    let scans = Pair { source: Given::new(source, "source")?, target: Given::new(target, "target")? };
    registered(py, threads, &scans, |source, target| {
        refine_traced(Pair { source, target }, &guess, prior.up, &config, &|_| ()).0
    })
}

/// Prepares both scans and registers them, all on threads of its own.
fn registered(
    py: Python<'_>,
    threads: Option<usize>,
    scans: &Pair<Given>,
    register: impl Fn(&Scan, &Scan) -> congruent_pipeline::Registration + Send + Sync,
) -> PyResult<Registration> {
    let prepared = || {
        let Pair { source, target } = scans.as_ref().par_map(Given::prepared);
        Ok(register(&source?, &target?))
    };
    on_threads(py, threads, prepared)?.map(|found| Registration { found })
}
