//! Scans, from files and from arrays.

use crate::arrays::{array, rows_of_three, three, triangles};
use crate::call::on_threads;
use congruent_geometry::{RawScan, ScanError, narrow, samples_of_coarse_mesh};
use congruent_io::{IoError, read_scan, read_scan_thinned};
use numpy::PyArray2;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A scan as in its file: points, and normals, triangles and a viewpoint where they are known.
#[pyclass(frozen, module = "congruent")]
pub(crate) struct Scan {
    raw: Arc<RawScan>,
}

#[pymethods]
impl Scan {
    #[new]
    #[pyo3(signature = (points, normals=None, *, triangles=None, viewpoint=None))]
    fn new(
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        triangles: Option<&Bound<'_, PyAny>>,
        viewpoint: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Scan> {
        let points = rows_of_three(points, "points")?;
        let normals = normals.map(|normals| rows_of_three(normals, "normals")).transpose()?;
        if let Some(normals) = normals.as_ref().filter(|normals| normals.len() != points.len()) {
            let (n, of) = (normals.len(), points.len());
            return Err(PyValueError::new_err(format!(
                "normals: {n} of them for {of} points; give one for each point"
            )));
        }
        let normals = normals.map(|normals| normals.iter().map(|n| narrow(&(*n).into())).collect());
        let triangles = triangles.map_or(Ok(Vec::new()), |given| self::triangles(given, points.len()))?;
        let points = points.into();
        let viewpoint = viewpoint.map(|given| three(given, "viewpoint")).transpose()?;
        Ok(Scan { raw: Arc::new(RawScan { points, normals, triangles, viewpoint, unread: Vec::new() }) })
    }

    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.raw.points.to_vec())
    }

    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f32>>> {
        self.raw.normals.as_ref().map(|normals| array(py, normals))
    }

    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        array(py, &self.raw.triangles)
    }

    #[getter]
    fn viewpoint(&self) -> Option<[f64; 3]> {
        self.raw.viewpoint
    }

    fn __len__(&self) -> usize {
        self.raw.points.len()
    }

    fn __repr__(&self) -> String {
        let RawScan { points, normals, triangles, .. } = &*self.raw;
        let normals = if normals.is_some() { "with" } else { "without" };
        format!("<congruent.Scan of {} points {normals} normals, {} triangles>", points.len(), triangles.len())
    }
}

/// Reads a scan from a file.
#[pyfunction]
#[pyo3(signature = (path, *, thin=None))]
pub(crate) fn read(py: Python<'_>, path: PathBuf, thin: Option<f64>) -> PyResult<Scan> {
    if let Some(thin) = thin.filter(|thin| !(thin.is_finite() && *thin > 0.0)) {
        return Err(PyValueError::new_err(format!("thin: the side of a cell is above zero, not {thin}")));
    }
    let read = on_threads(py, None, || match thin {
        None => read_scan(&path),
        Some(side) => read_scan_thinned(&path, side),
    })?;
    read.map(|raw| Scan { raw: Arc::new(raw) }).map_err(unreadable)
}

/// What a caller gave as a scan, and what messages call it.
pub(crate) struct Given {
    what: String,
    content: Content,
}

enum Content {
    Scan(Arc<RawScan>),
    File(PathBuf),
}

impl Given {
    /// Takes a [`Scan`], the path of a file, or points.
    pub(crate) fn new(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Given> {
        let content = if let Ok(scan) = given.cast::<Scan>() {
            Content::Scan(scan.get().raw.clone())
        } else if let Ok(path) = given.extract::<PathBuf>() {
            Content::File(path)
        } else {
            Content::Scan(Arc::new(RawScan { points: rows_of_three(given, what)?.into(), ..RawScan::default() }))
        };
        Ok(Given { what: what.to_owned(), content })
    }

    /// Reads the file, if it is one, and cleans the scan.
    pub(crate) fn prepared(&self) -> PyResult<congruent_geometry::Scan> {
        let scan = match &self.content {
            Content::Scan(raw) => cleaned(raw),
            Content::File(path) => cleaned(&read_scan(path).map_err(unreadable)?),
        };
        scan.map_err(|error| PyValueError::new_err(format!("{}: {error}", self.what)))
    }
}

fn cleaned(raw: &RawScan) -> Result<congruent_geometry::Scan, ScanError> {
    // The corners of a CAD model say little about its surface.
    congruent_geometry::Scan::new(samples_of_coarse_mesh(raw).as_ref().unwrap_or(raw))
}

fn unreadable(error: IoError) -> PyErr {
    let message = error.to_string();
    match error {
        IoError::Read { .. } | IoError::Directory { .. } => PyOSError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}
