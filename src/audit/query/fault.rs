//! What polars says against a query, in the words of the run's tables.

use polars::prelude::PolarsError;

use crate::error::{Error, nearest};

/// The fault of a query over `tables`, each a name with its columns.
pub(super) fn of(error: &PolarsError, tables: &[(&str, Vec<String>)]) -> Error {
    match error {
        PolarsError::Context { error, .. } | PolarsError::ExprContext { error, .. } => {
            of(error, tables)
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
    let hint =
        nearest(name, all()).map_or_else(|| ".".into(), |near| format!("; did you mean `{near}`?"));
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
