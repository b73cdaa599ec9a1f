//! Rust types that are one cell of a column.

use arrow::array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int64Array, StringArray, StringBuilder,
};
use arrow::datatypes::DataType;
use std::sync::Arc;

/// A Rust type that is one cell of a column.
pub trait Cell: Sized + Clone {
    /// The type of its column.
    fn data_type() -> DataType;
    /// Whether the column may hold nulls.
    fn nullable() -> bool {
        false
    }
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
            fn nullable() -> bool {
                true
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
