//! Many scans in one frame.

use crate::arrays::matrix;
use crate::call::{config, on_threads};
use crate::scan::Given;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

/// All scans, in as few frames as their connections allow.
#[pyclass(frozen, module = "congruent")]
pub(crate) struct Model {
    model: congruent_reconstruction::Model,
}

#[pymethods]
impl Model {
    #[getter]
    fn components(&self) -> Vec<Vec<usize>> {
        self.model.components.clone()
    }

    #[getter]
    fn frame_from_scan<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        self.model.frame_from_scan.iter().map(|pose| matrix(py, pose)).collect()
    }

    #[getter]
    fn uncertainty(&self) -> Vec<Option<f64>> {
        self.model.uncertainty.clone()
    }

    #[getter]
    fn conflicts(&self) -> Vec<(usize, usize)> {
        self.model.conflicts.iter().map(|conflict| conflict.scans.into()).collect()
    }

    fn __repr__(&self) -> String {
        let placed = self.model.components.first().map_or(0, Vec::len);
        let (n, conflicts) = (self.model.frame_from_scan.len(), self.model.conflicts.len());
        format!("<congruent.Model, {placed} of {n} scans in one frame, {conflicts} conflicts>")
    }
}

/// Puts many scans into one frame.
#[pyfunction]
#[pyo3(signature = (scans, config="default", *, settings=None, seed=None, threads=None))]
pub(crate) fn reconstruct(
    py: Python<'_>,
    scans: Vec<Bound<'_, PyAny>>,
    config: &str,
    settings: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Model> {
    let config = self::config(config, settings, seed)?;
    let scans = scans.iter().enumerate().map(|(at, scan)| Given::new(scan, &format!("scans[{at}]")));
    let scans = scans.collect::<PyResult<Vec<Given>>>()?;
    let solved = || {
        let scans = scans.par_iter().map(Given::prepared).collect::<PyResult<Vec<_>>>()?;
        Ok(congruent_reconstruction::reconstruct(&scans, &config))
    };
    on_threads(py, threads, solved)?.map(|model| Model { model })
}
