//! An answer for other programs: CSV and JSON, numbers to the last digit, every row.

use crate::audit::{QueryResult, QueryValue};
use crate::error::{Error, Result};
use std::borrow::Cow;
use std::fmt::Display;

/// A header, then the rows; null is an empty cell.
pub fn csv(answer: &QueryResult) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(answer.names().map(|name| inert(Cow::Borrowed(name))))
        .map_err(bug)?;
    for row in 0..answer.rows() {
        let cells = answer.row(row).map(|value| match value {
            QueryValue::Null => String::new(),
            QueryValue::Boolean(truth) => truth.to_string(),
            QueryValue::Integer(number) => number.to_string(),
            // As short as it can be and still be the same number: 1e-7, not 0.0000001.
            QueryValue::Number(number) => format!("{number:?}"),
            QueryValue::Text(text) => inert(text),
        });
        writer.write_record(cells).map_err(bug)?;
    }
    String::from_utf8(writer.into_inner().map_err(bug)?).map_err(bug)
}

/// A text that a spreadsheet would run as a formula gets a quote in front, as spreadsheets mark a text.
fn inert(text: Cow<str>) -> String {
    let runs = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    if runs {
        format!("'{text}")
    } else {
        text.into_owned()
    }
}

/// One array of objects, a row a line, columns in their order; what is no number is null.
pub fn json(answer: &QueryResult) -> Result<String> {
    let quoted = |text: &str| serde_json::to_string(text).map_err(bug);
    let names = answer
        .names()
        .map(quoted)
        .collect::<Result<Vec<String>>>()?;
    let mut rows = Vec::with_capacity(answer.rows());
    for row in 0..answer.rows() {
        let mut cells = Vec::with_capacity(names.len());
        for (name, value) in names.iter().zip(answer.row(row)) {
            let value = match value {
                QueryValue::Null => "null".into(),
                QueryValue::Boolean(truth) => truth.to_string(),
                QueryValue::Integer(number) => number.to_string(),
                QueryValue::Number(number) => serde_json::to_string(&number).map_err(bug)?,
                QueryValue::Text(text) => quoted(&text)?,
            };
            cells.push(format!("{name}: {value}"));
        }
        rows.push(format!("  {{{}}}", cells.join(", ")));
    }
    Ok(if rows.is_empty() {
        "[]\n".into()
    } else {
        format!("[\n{}\n]\n", rows.join(",\n"))
    })
}

fn bug(error: impl Display) -> Error {
    Error::Bug(error.to_string())
}
