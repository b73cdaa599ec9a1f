//! A checked frame: columns that satisfy a table's schema (types, nulls, key, ranges; no NaN).

use arrow::array::{Array, ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Schema};
use std::sync::Arc;

use crate::error::{Error, Result};

/// Columns of one table kind, in memory.
#[derive(Debug, Clone)]
pub struct Frame {
    pub kind: String,
    pub batch: RecordBatch,
}

/// Collects columns by name, then checks them against the schema of `kind`.
pub struct FrameBuilder {
    kind: String,
    columns: Vec<(String, ArrayRef)>,
}

impl FrameBuilder {
    pub fn new(kind: &str) -> Self {
        Self { kind: kind.into(), columns: Vec::new() }
    }
    pub fn push(&mut self, name: impl Into<String>, column: ArrayRef) {
        self.columns.push((name.into(), column));
    }
    pub fn finish(self) -> Result<Frame> {
        let fields: Vec<Field> =
            self.columns.iter().map(|(name, array)| Field::new(name, array.data_type().clone(), true)).collect();
        let arrays = self.columns.into_iter().map(|(_, array)| array).collect();
        let batch = RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(|e| Error::Bug(e.to_string()))?;
        Ok(Frame { kind: self.kind, batch })
    }
}

impl Frame {
    pub fn rows(&self) -> usize {
        self.batch.num_rows()
    }
    pub fn column(&self, name: &str) -> Option<&ArrayRef> {
        self.batch.column_by_name(name)
    }
    /// A column as Rust values, or what is missing.
    pub fn read<C: Cell>(&self, name: &str) -> Result<Vec<C>> {
        let array = self.column(name).ok_or_else(|| Error::Bug(format!("table {}: no column {name}", self.kind)))?;
        C::from_array(array).ok_or_else(|| Error::Bug(format!("table {}: column {name} has another type or nulls", self.kind)))
    }
}

/// A Rust type that is one cell of a column.
pub trait Cell: Sized + Clone {
    fn data_type() -> DataType;
    fn nullable() -> bool {
        false
    }
    fn to_array(values: Vec<Self>) -> ArrayRef;
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
                (array.null_count() == 0).then(|| (0..array.len()).map(|i| $get(array, i)).collect())
            }
        }
        impl Cell for Option<$rust> {
            fn data_type() -> DataType {
                $data
            }
            fn nullable() -> bool {
                true
            }
            fn to_array(values: Vec<Self>) -> ArrayRef {
                Arc::new(<$array>::from(values))
            }
            fn from_array(array: &ArrayRef) -> Option<Vec<Self>> {
                let array = array.as_any().downcast_ref::<$array>()?;
                Some((0..array.len()).map(|i| (!array.is_null(i)).then(|| $get(array, i))).collect())
            }
        }
    };
}
cell!(f64, Float64Array, DataType::Float64, |a: &Float64Array, i| a.value(i));
cell!(i64, Int64Array, DataType::Int64, |a: &Int64Array, i| a.value(i));
cell!(bool, BooleanArray, DataType::Boolean, |a: &BooleanArray, i| a.value(i));
cell!(String, StringArray, DataType::Utf8, |a: &StringArray, i| a.value(i).to_string());
