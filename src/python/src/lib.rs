//! What the Python package `calib` is made of: the facade `calib::api` without documentation and without a lock on the interpreter.

mod arrays;
mod classes;
mod frame;
mod wait;

use calib::effect::CAUSES;
use calib::error::Error;
use calib::robot::LIBRARY;
use calib::summary::effects_json;
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::ffi::OsString;

create_exception!(calib, SpecError, PyValueError);
create_exception!(calib, DataError, PyValueError);
create_exception!(calib, StoreError, PyOSError);

/// The exception of an error, with the sentence of the command line.
fn raised(error: Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Spec(_) => SpecError::new_err(message),
        Error::Data(_) => DataError::new_err(message),
        Error::Store(_) => StoreError::new_err(message),
        Error::Bug(_) => PyRuntimeError::new_err(message),
    }
}

#[pyfunction]
fn effects() -> String {
    effects_json(CAUSES).to_string()
}

#[pyfunction]
fn robots() -> Vec<&'static str> {
    LIBRARY.iter().map(|arm| arm.name).collect()
}

/// Runs a command line and gives its exit code.
#[pyfunction]
fn command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| calib::cli::main(arguments))
}

#[pymodule]
fn _calib(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SpecError", py.get_type::<SpecError>())?;
    module.add("DataError", py.get_type::<DataError>())?;
    module.add("StoreError", py.get_type::<StoreError>())?;
    module.add_class::<frame::Frame>()?;
    module.add_class::<classes::Robot>()?;
    module.add_class::<classes::Model>()?;
    module.add_class::<classes::Outcome>()?;
    module.add_class::<classes::Run>()?;
    module.add_function(wrap_pyfunction!(classes::run, module)?)?;
    module.add_function(wrap_pyfunction!(classes::open_run, module)?)?;
    module.add_function(wrap_pyfunction!(effects, module)?)?;
    module.add_function(wrap_pyfunction!(robots, module)?)?;
    module.add_function(wrap_pyfunction!(command, module)?)
}
