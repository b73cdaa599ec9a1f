//! What a query gave: columns of values.

use crate::error::{Error, suggestion};
use polars::prelude::{AnyValue, Column, DataFrame, PolarsError};
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
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.columns().iter().map(|column| column.name().as_str())
    }

    /// The values of a row, counted from 0, in the order of the names.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = QueryValue<'_>> {
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

/// The fault of a query over `tables`, each a name with its columns.
pub(super) fn fault_of(error: &PolarsError, tables: &[(&str, Vec<String>)]) -> Error {
    match error {
        PolarsError::Context { error, .. } | PolarsError::ExprContext { error, .. } => {
            fault_of(error, tables)
        }
        _ => {
            let text = error.to_string();
            let message = missing(&text)
                .and_then(|name| unknown(name, tables))
                .unwrap_or_else(|| first(&text));
            Error::spec("SQL", message)
        }
    }
}

/// The column that polars did not find, if that is what it says.
fn missing(text: &str) -> Option<&str> {
    let after = [
        "unable to find column \"",
        "no column named '",
        "no table or struct column named '",
    ];
    let rest = after
        .into_iter()
        .find_map(|words| text.split_once(words))?
        .1;
    rest.split(['"', '\'']).next()
}

/// Nothing where a table has the column: then it is lost on the way, and polars says where.
fn unknown(name: &str, tables: &[(&str, Vec<String>)]) -> Option<String> {
    let all = || {
        tables
            .iter()
            .flat_map(|(_, columns)| columns)
            .map(String::as_str)
    };
    if tables.is_empty() || all().any(|column| column == name) {
        return None;
    }
    let hint = suggestion(name, all());
    let known: Vec<String> = tables
        .iter()
        .map(|(table, columns)| format!("{table}: {}", columns.join(", ")))
        .collect();
    Some(format!(
        "no column `{name}`{hint} Columns of {}",
        known.join("; of ")
    ))
}

/// Without the plan that polars prints below.
fn first(text: &str) -> String {
    text.split("\n\n").next().unwrap_or(text).trim().to_string()
}
