//! What a query gave: columns of values.

use polars::prelude::{AnyValue, Column, DataFrame};
use std::borrow::Cow;

/// The rows that a query gave.
#[derive(Debug)]
pub struct QueryResult(DataFrame);

/// One value of an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum QueryValue<'a> {
    /// Missing.
    Null,
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i128),
    /// A number.
    Number(f64),
    /// Text.
    Text(Cow<'a, str>),
}

impl QueryResult {
    pub(super) fn new(frame: DataFrame) -> Self {
        Self(frame)
    }

    /// How many.
    pub fn rows(&self) -> usize {
        self.0.height()
    }

    /// Names of the columns, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.columns().iter().map(|column| column.name().as_str())
    }

    /// The values of a row, counted from 0, in the order of the names.
    pub fn row(&self, row: usize) -> impl Iterator<Item = QueryValue<'_>> {
        self.0
            .columns()
            .iter()
            .map(move |column| value(column, row))
    }

    /// The first `rows` values of every column.
    pub fn columns(&self, rows: usize) -> impl Iterator<Item = Vec<QueryValue<'_>>> {
        let rows = rows.min(self.rows());
        self.0
            .columns()
            .iter()
            .map(move |column| (0..rows).map(|row| value(column, row)).collect())
    }
}

fn value(column: &Column, row: usize) -> QueryValue<'_> {
    let Ok(value) = column.get(row) else {
        return QueryValue::Null;
    };
    match value {
        AnyValue::Null => QueryValue::Null,
        AnyValue::Boolean(truth) => QueryValue::Boolean(truth),
        AnyValue::String(text) => QueryValue::Text(text.into()),
        AnyValue::StringOwned(text) => QueryValue::Text(text.to_string().into()),
        AnyValue::Float64(number) => QueryValue::Number(number),
        AnyValue::Float32(number) => QueryValue::Number(number.into()),
        AnyValue::Int8(number) => QueryValue::Integer(number.into()),
        AnyValue::Int16(number) => QueryValue::Integer(number.into()),
        AnyValue::Int32(number) => QueryValue::Integer(number.into()),
        AnyValue::Int64(number) => QueryValue::Integer(number.into()),
        AnyValue::Int128(number) => QueryValue::Integer(number),
        AnyValue::UInt8(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt16(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt32(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt64(number) => QueryValue::Integer(number.into()),
        // Dates, lists and what else a query may make: as polars writes them.
        other => QueryValue::Text(other.to_string().into()),
    }
}
