//! A checked frame: columns that satisfy their table's schema (exact columns, types, nulls, ranges, key; no NaN).
//!
//! [`FrameBuilder::finish`] is the border: behind it nothing is checked again. Columns come out in the order of the schema and
//! rows in the order of the key, so that neither the order of pushing nor that of computing shows in the content.

use arrow::array::{Array, ArrayRef, Float64Array, RecordBatch, new_null_array};
use arrow::buffer::NullBuffer;
use arrow::datatypes::SchemaRef;
use std::sync::Arc;

pub use super::cell::{Cell, TextCells};
use super::check;
use super::schema::{self, TableSchema};
use crate::error::{Error, Result};

/// A column before it is checked.
pub type Column = ArrayRef;

/// Columns of one table kind, in memory, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    schema: &'static TableSchema,
    batch: RecordBatch,
}

/// Collects columns by name, then checks them against the schema of `kind`.
pub struct FrameBuilder {
    kind: String,
    columns: Vec<(String, ArrayRef)>,
}

impl FrameBuilder {
    /// An empty frame of a kind.
    pub fn new(kind: &str) -> Self {
        Self {
            kind: kind.into(),
            columns: Vec::new(),
        }
    }
    /// Adds a column.
    pub fn push(&mut self, name: impl Into<String>, column: ArrayRef) {
        self.columns.push((name.into(), column));
    }
    /// Adds a column of numbers, NaN for null.
    pub fn push_numbers(&mut self, name: impl Into<String>, values: impl Iterator<Item = f64>) {
        let mut values: Vec<f64> = values.collect();
        let nulls = values.iter().any(|value| value.is_nan()).then(|| {
            let present = values
                .iter()
                .map(|value| !value.is_nan())
                .collect::<NullBuffer>();
            values
                .iter_mut()
                .filter(|value| value.is_nan())
                .for_each(|value| *value = 0.0);
            present
        });
        self.push(name, Arc::new(Float64Array::new(values.into(), nulls)));
    }
    /// Adds a column, but an optional one without a value is left out: tables that never needed it stay as they are.
    pub fn push_present(&mut self, name: &str, column: ArrayRef) -> Result<()> {
        let optional = schema::of(&self.kind)?
            .fields
            .iter()
            .any(|field| field.name == name && field.optional);
        if !optional || column.null_count() < column.len() {
            self.push(name, column);
        }
        Ok(())
    }
    /// Checks the columns. Values out of range are errors of the data, all else is a bug of the stage.
    pub fn finish(self) -> Result<Frame> {
        let schema = schema::of(&self.kind)?;
        Ok(Frame {
            schema,
            batch: check::parse(schema, self.columns)?,
        })
    }
}

impl Frame {
    /// The name of its schema.
    pub fn kind(&self) -> &'static str {
        &self.schema.name
    }
    /// What it holds.
    pub fn schema(&self) -> &'static TableSchema {
        self.schema
    }
    /// Its columns as Arrow has them.
    pub fn batch(&self) -> &RecordBatch {
        &self.batch
    }
    /// How many.
    pub fn rows(&self) -> usize {
        self.batch.num_rows()
    }
    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&ArrayRef> {
        self.batch.column_by_name(name)
    }
    /// In the order of the file.
    pub fn column_names(&self) -> impl Iterator<Item = &str> {
        self.batch
            .schema_ref()
            .fields()
            .iter()
            .map(|field| field.name().as_str())
    }
    /// A column as Rust values, or what is missing. An optional column that is not there is all null.
    pub fn read<C: Cell>(&self, name: &str) -> Result<Vec<C>> {
        if self.column(name).is_none()
            && self
                .schema
                .fields
                .iter()
                .any(|field| field.name == name && field.optional)
        {
            let nulls = new_null_array(&C::data_type(), self.rows());
            return C::from_array(&nulls)
                .ok_or_else(|| Error::Bug(format!("table {}: no column {name}", self.kind())));
        }
        let array = self
            .column(name)
            .ok_or_else(|| Error::Bug(format!("table {}: no column {name}", self.kind())))?;
        C::from_array(array).ok_or_else(|| {
            Error::Bug(format!(
                "table {}: column {name} has another type or nulls",
                self.kind()
            ))
        })
    }
    pub(super) fn arrow_schema(&self) -> SchemaRef {
        self.batch.schema()
    }
}
