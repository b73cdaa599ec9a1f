//! An answer for a person: columns below each other, numbers with the digits that tell something, as wide as the terminal.

use super::screen::cut;
use crate::audit::{QueryResult, QueryValue};
use crate::error::{Error, Result, counted, one_line};
use crate::table::inert;
use std::borrow::Cow;
use std::fmt::Display;
use unicode_width::UnicodeWidthStr;

/// Significant digits of the largest number of a column: more than any recording tells, fewer than hide a drift from row to row.
const DIGITS: i32 = 6;
/// Decimals of a length in mm at least: a tracker tells micrometres also far away.
const LENGTH: i32 = 4;
/// Digits that the smallest one keeps at least; below, every number of the column is written by itself.
const LEAST: i32 = 3;
/// A text that is longer is cut on every terminal: some tables hold whole documents.
const LONGEST: usize = 80;
/// A text is not cut shorter than this to make room.
const SHORTEST: usize = 12;

struct Drawn {
    name: String,
    right: bool,
    cells: Vec<String>,
    width: usize,
}

/// The first rows, and how many are left out.
pub fn grid(answer: &QueryResult, rows: usize, width: Option<usize>) -> String {
    let shown = rows.min(answer.rows());
    let columns = answer
        .names()
        .zip(answer.columns(shown))
        .map(|(name, values)| drawn(name, &values))
        .collect();
    let mut text = draw(columns, shown, width);
    if answer.rows() > shown {
        text.push_str(&format!(
            "{}: --rows N shows N of them, --csv and --json all\n",
            counted(answer.rows() - shown, "more row")
        ));
    } else if answer.rows() == 0 {
        text.push_str("no rows\n");
    }
    text
}

fn draw(mut columns: Vec<Drawn>, rows: usize, width: Option<usize>) -> String {
    let left_out = width.map_or_else(Vec::new, |width| fit(&mut columns, width));
    let mut text = line(columns.iter().map(|column| (column, column.name.as_str())));
    for row in 0..rows {
        text.push_str(&line(columns.iter().map(|column| {
            (column, column.cells.get(row).map_or("", String::as_str))
        })));
    }
    if !left_out.is_empty() {
        text.push_str(&format!("too narrow for: {}\n", left_out.join(", ")));
    }
    text
}

fn line<'a>(cells: impl Iterator<Item = (&'a Drawn, &'a str)>) -> String {
    let cells = cells.map(|(column, cell)| {
        let cell = cut(cell, column.width);
        let blank = " ".repeat(column.width.saturating_sub(cell.width()));
        match column.right {
            true => blank + &cell,
            false => cell + &blank,
        }
    });
    let line = cells.collect::<Vec<_>>().join("  ");
    format!("{}\n", line.trim_end())
}

/// Cuts long texts first, then leaves out the last columns; gives the names of these.
fn fit(columns: &mut Vec<Drawn>, width: usize) -> Vec<String> {
    let excess = |columns: &[Drawn]| {
        let all: usize = columns.iter().map(|column| column.width + 2).sum();
        all.saturating_sub(width + 2)
    };
    while excess(columns) > 0 {
        let too_much = excess(columns);
        let long = columns
            .iter_mut()
            .filter(|column| !column.right && column.width > SHORTEST);
        let Some(widest) = long.max_by_key(|column| column.width) else {
            break;
        };
        widest.width = widest.width.saturating_sub(too_much).max(SHORTEST);
    }
    let mut left_out = Vec::new();
    while excess(columns) > 0 && columns.len() > 1 {
        left_out.extend(columns.pop().map(|column| column.name));
    }
    left_out.reverse();
    left_out
}

fn drawn(name: &str, values: &[QueryValue]) -> Drawn {
    let is_right = |value: &QueryValue| {
        use QueryValue::{Integer, Null, Number};
        matches!(value, Null | Integer(_) | Number(_))
    };
    let right = values.iter().all(is_right);
    let decimals = decimals(values, if name.ends_with("_mm") { LENGTH } else { 0 });
    let mut cells: Vec<String> = values
        .iter()
        .map(|value| match value {
            QueryValue::Null => String::new(),
            QueryValue::Boolean(truth) => truth.to_string(),
            QueryValue::Integer(number) => number.to_string(),
            QueryValue::Number(number) => written(*number, decimals),
            QueryValue::Text(text) => cut(&one_line(text), LONGEST),
        })
        .collect();
    if right && decimals.is_some() {
        shorten(&mut cells);
    }
    let width = cells
        .iter()
        .map(|cell| cell.width())
        .chain([name.width()])
        .max()
        .unwrap_or(0);
    Drawn {
        name: name.into(),
        right,
        cells,
        width,
    }
}

/// Decimals that suit all numbers of a column, at least so many; nothing where they are of too different sizes.
fn decimals(values: &[QueryValue], least: i32) -> Option<usize> {
    let sizes = values.iter().filter_map(|value| match value {
        QueryValue::Number(number) => Some(number.abs()),
        _ => None,
    });
    let sizes = sizes.filter(|size| size.is_finite() && *size > 0.0);
    let ends = sizes.fold(None, |ends, size| {
        let (smallest, largest) = ends.unwrap_or((size, size));
        Some((size.min(smallest), size.max(largest)))
    });
    let Some((smallest, largest)) = ends else {
        return Some(0);
    };
    let decimals = (DIGITS - 1 - power(largest)).max(least);
    let alike = power(smallest) + decimals >= LEAST - 1 && decimals <= 9 && power(largest) < 9;
    usize::try_from(decimals).ok().filter(|_| alike)
}

/// 2 of 345.0, -3 of 0.0012.
fn power(size: f64) -> i32 {
    format!("{size:e}")
        .split_once('e')
        .and_then(|(_, power)| power.parse().ok())
        .unwrap_or(0)
}

fn written(number: f64, decimals: Option<usize>) -> String {
    match decimals {
        Some(decimals) => format!("{number:.decimals$}"),
        None if number == 0.0 => "0".into(),
        None if (1e-4..1e9).contains(&number.abs()) => {
            let decimals = usize::try_from(DIGITS - 1 - power(number.abs())).unwrap_or(0);
            format!("{number:.decimals$}")
        }
        None => format!("{number:.*e}", usize::try_from(DIGITS - 1).unwrap_or(0)),
    }
}

/// Takes away zeros that end every number of a column.
fn shorten(cells: &mut [String]) {
    let number = |cell: &&mut String| cell.contains('.');
    while cells.iter().any(|cell| cell.contains('.'))
        && cells
            .iter_mut()
            .filter(number)
            .all(|cell| cell.ends_with(['0', '.']))
    {
        cells.iter_mut().filter(number).for_each(|cell| {
            cell.pop();
        });
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(values: &[f64]) -> Vec<String> {
        drawn(
            "n",
            &values
                .iter()
                .map(|value| QueryValue::Number(*value))
                .collect::<Vec<_>>(),
        )
        .cells
    }

    #[test]
    fn a_column_has_the_digits_of_its_largest_number() {
        assert_eq!(numbers(&[18.143812, 0.017901]), ["18.1438", "0.0179"]);
        assert_eq!(numbers(&[1.5, 20.25, 0.0]), ["1.50", "20.25", "0.00"]);
        assert_eq!(numbers(&[200.0, 50.0]), ["200", "50"]);
        assert_eq!(numbers(&[1.2e-5, -3.4e-4]), ["0.000012", "-0.000340"]);
        assert_eq!(numbers(&[0.0, f64::NAN]), ["0", "NaN"]);
        assert_eq!(numbers(&[]), [""; 0]);
    }

    #[test]
    fn a_length_far_away_keeps_its_micrometres() {
        assert_eq!(
            drawn("x_mm", &[QueryValue::Number(4744.84123)]).cells,
            ["4744.8412"]
        );
        assert_eq!(
            drawn("x_mm", &[QueryValue::Number(0.0286965)]).cells,
            ["0.0286965"]
        );
    }

    #[test]
    fn numbers_of_different_sizes_are_written_each_by_itself() {
        assert_eq!(
            numbers(&[1594.0, 2.5e-7, 0.0]),
            ["1594.00", "2.50000e-7", "0"]
        );
        assert_eq!(numbers(&[1e300]), ["1.00000e300"]);
    }

    #[test]
    fn a_narrow_terminal_cuts_texts_and_then_columns() {
        let columns = || {
            let text = |text: &str| QueryValue::Text(text.to_string().into());
            vec![
                drawn("point", &[text("P1"), text("a point with a long name")]),
                drawn("x_mm", &[QueryValue::Number(1954.25), QueryValue::Null]),
                drawn(
                    "kept",
                    &[QueryValue::Boolean(true), QueryValue::Boolean(false)],
                ),
            ]
        };
        assert_eq!(
            draw(columns(), 2, None),
            "point                        x_mm  kept\nP1                        1954.25  true\na point with a long name           false\n"
        );
        let narrow = draw(columns(), 2, Some(30));
        assert!(
            narrow.lines().all(|line| line.width() <= 30) && narrow.contains("a point with …"),
            "{narrow}"
        );
        let narrower = draw(columns(), 2, Some(24));
        assert!(narrower.ends_with("too narrow for: kept\n"), "{narrower}");
    }

    #[test]
    fn a_text_keeps_its_zeros() {
        assert_eq!(
            drawn(
                "version",
                &[
                    QueryValue::Text("1.0".into()),
                    QueryValue::Text("2.0".into())
                ]
            )
            .cells,
            ["1.0", "2.0"]
        );
    }

    #[test]
    fn a_wide_letter_counts_twice() {
        assert_eq!(cut("関節関節", 5), "関節…");
        assert_eq!(cut("joint", 5), "joint");
    }
}
