//! The Python module `congruent`: scans, their registration, and many scans in one frame.
//!
//! `congruent.pyi` documents the module for its users. Every call releases the interpreter while it works, on a thread pool of
//! its own: a pool shared between calls would not survive a fork.

mod arrays;
mod call;
mod model;
mod registration;
mod scan;

use pyo3::prelude::*;

#[pymodule(name = "congruent")]
mod module {
    #[pymodule_export]
    use crate::model::{Model, reconstruct};
    #[pymodule_export]
    use crate::registration::{Registration, refine, register};
    #[pymodule_export]
    use crate::scan::{Scan, read};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
