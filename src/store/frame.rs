//! A checked frame: columns that satisfy their table's schema (exact columns, types, nulls, ranges, key; no NaN).
//!
//! [`FrameBuilder::finish`] is the border: behind it nothing is checked again. Columns come out in the order of the schema and
//! rows in the order of the key, so that neither the order of pushing nor that of computing shows in the content.

use super::check;
use super::schema::{self, TableSchema};
use crate::error::{Error, Result};
use arrow::array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray,
    StringBuilder, new_null_array,
};
use arrow::buffer::NullBuffer;
use arrow::datatypes::{DataType, SchemaRef};
use std::sync::Arc;

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
    /// Checks the columns. Values out of range are errors of the data in a table of what people gave, all else is a bug of the stage.
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
        let fault = |what: String| Error::Bug(format!("table {}: {what}", self.kind()));
        let mut fields = self.schema.fields.iter();
        let array = match self.column(name) {
            Some(array) => array.clone(),
            None if fields.any(|field| field.name == name && field.optional) => {
                new_null_array(&C::data_type(), self.rows())
            }
            None => return Err(fault(format!("no column {name}"))),
        };
        C::from_array(&array)
            .ok_or_else(|| fault(format!("column {name} has another type or nulls")))
    }
    pub(super) fn arrow_schema(&self) -> SchemaRef {
        self.batch.schema()
    }
}

/// A Rust type that is one cell of a column.
pub trait Cell: Sized + Clone {
    /// The type of its column.
    fn data_type() -> DataType;
    /// A column of values.
    fn to_array(values: Vec<Self>) -> ArrayRef;
    /// None where the column has another type, or nulls that `Self` cannot hold.
    fn from_array(array: &ArrayRef) -> Option<Vec<Self>>;
}

macro_rules! cell {
    ($rust:ty, $array:ty, $data:expr, $get:expr) => {
        impl Cell for $rust {
            fn data_type() -> DataType {
                $data
            }
            fn to_array(values: Vec<Self>) -> ArrayRef {
                Arc::new(<$array>::from(values))
            }
            fn from_array(array: &ArrayRef) -> Option<Vec<Self>> {
                let array = array.as_any().downcast_ref::<$array>()?;
                (array.null_count() == 0)
                    .then(|| (0..array.len()).map(|i| $get(array, i)).collect())
            }
        }
        impl Cell for Option<$rust> {
            fn data_type() -> DataType {
                $data
            }
            fn to_array(values: Vec<Self>) -> ArrayRef {
                Arc::new(<$array>::from(values))
            }
            fn from_array(array: &ArrayRef) -> Option<Vec<Self>> {
                let array = array.as_any().downcast_ref::<$array>()?;
                Some(
                    (0..array.len())
                        .map(|i| (!array.is_null(i)).then(|| $get(array, i)))
                        .collect(),
                )
            }
        }
    };
}
cell!(
    f64,
    Float64Array,
    DataType::Float64,
    |a: &Float64Array, i| a.value(i)
);
cell!(i64, Int64Array, DataType::Int64, |a: &Int64Array, i| a
    .value(i));
cell!(
    bool,
    BooleanArray,
    DataType::Boolean,
    |a: &BooleanArray, i| a.value(i)
);
cell!(String, StringArray, DataType::Utf8, |a: &StringArray, i| a
    .value(i)
    .to_string());

/// A column of texts that grows cell by cell, without a text of its own for each.
#[derive(Default)]
pub struct TextCells(StringBuilder);

impl TextCells {
    /// Adds a cell; none is null.
    pub fn push(&mut self, text: Option<&str>) {
        self.0.append_option(text);
    }
    /// The column so far; what follows begins another.
    pub fn take(&mut self) -> ArrayRef {
        Arc::new(self.0.finish())
    }
}
