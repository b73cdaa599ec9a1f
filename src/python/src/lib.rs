//! calib for Python.
use pyo3::prelude::*;

#[pymodule]
fn _calib(_module: &Bound<'_, PyModule>) -> PyResult<()> {
    Ok(())
}
