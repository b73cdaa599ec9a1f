//! A table of calib, for whoever takes Arrow.

use crate::raised;
use arrow::datatypes::DataType;
use arrow::ffi::FFI_ArrowSchema;
use arrow::ffi_stream::FFI_ArrowArrayStream;
use arrow::record_batch::RecordBatchIterator;
use calib::store::frame::{self, Cell};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

#[pyclass(frozen)]
pub struct Frame(pub frame::Frame);

impl Frame {
    fn read<'py, C: Cell + IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        name: &str,
    ) -> PyResult<Py<PyAny>> {
        let values = self.0.read::<C>(name).map_err(raised)?;
        values.into_py_any(py)
    }
}

#[pymethods]
impl Frame {
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind()
    }
    #[getter]
    fn columns(&self) -> Vec<&str> {
        self.0.column_names().collect()
    }
    #[getter]
    fn rows(&self) -> usize {
        self.0.rows()
    }

    /// A column as a list, None where nothing is known; no column, no list.
    fn column(&self, py: Python<'_>, name: &str) -> PyResult<Option<Py<PyAny>>> {
        let column = self.0.column(name);
        let read = column.map(|column| match column.data_type() {
            DataType::Float64 => self.read::<Option<f64>>(py, name),
            DataType::Int64 => self.read::<Option<i64>>(py, name),
            DataType::Boolean => self.read::<Option<bool>>(py, name),
            _ => self.read::<Option<String>>(py, name),
        });
        read.transpose()
    }

    fn schema_capsule<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.0.batch().schema().as_ref());
        let schema = schema.map_err(|error| PyValueError::new_err(error.to_string()))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    fn stream_capsule<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let batch = self.0.batch().clone();
        let schema = batch.schema();
        let batches = RecordBatchIterator::new([Ok(batch)], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}
