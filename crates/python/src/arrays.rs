//! Between arrays of NumPy and our types.

use congruent_geometry::{RigidTransform, to_rows};
use congruent_io::Motion;
use numpy::{
    AllowTypeChange, Element, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Returns the rows of an array with three columns, or of what NumPy turns into one; `what` is for the message.
pub(crate) fn rows_of_three(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f64; 3]>> {
    let numbers = numbers(given, what)?;
    match numbers.shape() {
        [_, 3] => Ok(numbers.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect()),
        [0, _] => Ok(Vec::new()),
        shape => Err(PyValueError::new_err(format!(
            "{what}: an array of shape (n, 3) is expected, not {shape:?}; one row for each point"
        ))),
    }
}

/// Returns three numbers: a position or a direction.
pub(crate) fn three(given: &Bound<'_, PyAny>, what: &str) -> PyResult<[f64; 3]> {
    let numbers: Option<PyArrayLike1<'_, f64, AllowTypeChange>> = given.extract().ok();
    let three = numbers.and_then(|numbers| numbers.as_array().to_vec().try_into().ok());
    three.ok_or_else(|| PyValueError::new_err(format!("{what}: three numbers are expected, not {given}")))
}

/// Returns triangles of `n` points from an array of whole numbers with three columns.
pub(crate) fn triangles(given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<[u32; 3]>> {
    let rows = rows_of_three(given, "triangles")?;
    let is_point = |corner: f64| corner >= 0.0 && corner < n as f64 && corner.fract() == 0.0;
    if let Some(corner) = rows.iter().flatten().find(|corner| !is_point(**corner)) {
        let message = format!("triangles: {corner} is none of the {n} points, which count from 0");
        return Err(PyValueError::new_err(message));
    }
    Ok(rows.into_iter().map(|row| row.map(|corner| corner as u32)).collect())
}

/// Returns the pose of a 4×4 array.
pub(crate) fn pose(given: &Bound<'_, PyAny>, what: &str) -> PyResult<RigidTransform> {
    let numbers = numbers(given, what)?;
    if numbers.shape() != [4, 4] {
        let shape = numbers.shape();
        return Err(PyValueError::new_err(format!("{what}: a matrix of shape (4, 4) is expected, not {shape:?}")));
    }
    let numbers = numbers.as_array();
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| numbers[[row, column]]));
    let motion = Motion::nearest(&rows, Motion::WARN_ABOVE);
    motion.map(|motion| motion.pose).map_err(|fault| PyValueError::new_err(format!("{what}: {fault}")))
}

fn numbers<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<PyArrayLike2<'py, f64, AllowTypeChange>> {
    let kind = given.get_type();
    given.extract().map_err(|_| {
        PyValueError::new_err(format!("{what}: a two-dimensional array of numbers is expected, not this {kind}"))
    })
}

/// Returns a pose as a 4×4 array.
pub(crate) fn matrix<'py>(py: Python<'py>, pose: &RigidTransform) -> Bound<'py, PyArray2<f64>> {
    array(py, &to_rows(pose))
}

/// Returns rows as an array.
pub(crate) fn array<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: &[[T; N]],
) -> Bound<'py, PyArray2<T>> {
    let flat = PyArray1::from_slice(py, rows.as_flattened());
    flat.reshape([rows.len(), N]).expect("as many numbers as there are")
}
