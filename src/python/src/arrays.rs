//! numpy arrays as rows of numbers, and back: by the buffer protocol, so that no numpy is linked.

use calib::api::{Poses, Recording, Robot, Sigma};
use pyo3::buffer::{PyBuffer, PyUntypedBuffer};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// The numbers of an array of float64, row-major, and its shape.
pub fn numbers(name: &str, array: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let buffer = PyUntypedBuffer::get(array).ok();
    let typed: Option<&PyBuffer<f64>> = buffer.as_ref().and_then(|all| all.as_typed().ok());
    let Some(typed) = typed else {
        let found = match array.getattr("dtype") {
            Ok(dtype) => format!("dtype {dtype}"),
            Err(_) => format!("a {}", array.get_type().name()?),
        };
        return Err(PyTypeError::new_err(format!(
            "{name}: {found}; expected an array of float64, e.g. numpy.asarray({name}, dtype=float)"
        )));
    };
    Ok((typed.to_vec(array.py())?, typed.shape().to_vec()))
}

/// A table of numbers with so many columns; `what` says what they are.
pub fn matrix(
    name: &str,
    array: &Bound<'_, PyAny>,
    columns: usize,
    what: &str,
) -> PyResult<Vec<f64>> {
    let (values, shape) = numbers(name, array)?;
    if shape.len() == 2 && shape[1] == columns {
        return Ok(values);
    }
    let message = format!("{name}: shape {shape:?}; expected [rows, {columns}]: {what}");
    Err(PyValueError::new_err(message))
}

/// Joints, and columns of the recording by their names: a number or a text for all rows, or one a row.
pub fn poses(
    robot: &Robot,
    joints: &Bound<'_, PyAny>,
    columns: &Bound<'_, PyDict>,
) -> PyResult<Recording> {
    let what = format!("a column for each joint of {}", robot.description.name);
    let joints_rad = matrix("joints", joints, robot.joints(), &what)?;
    let rows = joints_rad.len() / robot.joints();
    let (mut columns_found, mut names) = (BTreeMap::new(), BTreeMap::new());
    for (name, value) in columns {
        let name: String = name.extract()?;
        if let Ok(number) = value.extract::<f64>() {
            columns_found.insert(name, vec![number; rows]);
        } else if let Ok(text) = value.extract::<String>() {
            names.insert(name, vec![text; rows]);
        } else if let Ok(texts) = value.extract::<Vec<String>>() {
            names.insert(name, texts);
        } else {
            let (values, _) = numbers(&name, &value)?;
            columns_found.insert(name, values);
        }
    }
    let poses = Poses {
        joints_rad,
        columns: columns_found,
    };
    Ok(Recording {
        poses,
        names,
        ..Recording::default()
    })
}

/// Noise of points: none, a number, the name of an instrument, or an array.
pub fn sigma(given: Option<&Bound<'_, PyAny>>) -> PyResult<Sigma> {
    let Some(given) = given else {
        return Ok(Sigma::Inferred);
    };
    if let Ok(one) = given.extract::<f64>() {
        return Ok(Sigma::Mm(vec![one]));
    }
    if let Ok(name) = given.extract::<String>() {
        return Ok(Sigma::Instrument(name));
    }
    Ok(Sigma::Mm(numbers("sigma", given)?.0))
}

/// Numbers as an array of numpy, with so many columns where there are several.
pub fn array<'py>(py: Python<'py>, values: &[f64], columns: usize) -> PyResult<Bound<'py, PyAny>> {
    let flat = py.import("numpy")?.call_method1("empty", (values.len(),))?;
    PyBuffer::<f64>::get(&flat)?.copy_from_slice(py, values)?;
    match columns {
        1 => Ok(flat),
        _ => flat.call_method1("reshape", (values.len() / columns, columns)),
    }
}
