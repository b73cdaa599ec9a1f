//! A comparison as a short text: counts, columns that differ, the worst rows; never a dump.

use super::{ColumnDiff, Equal, TableDiff, WorstCell};
use crate::error::{Error, Result};
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior, Value, context};

/// How much a text shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Counts and columns.
    Stat,
    /// And the worst rows.
    Full,
}

/// A comparison as text.
pub fn text(diff: &TableDiff, detail: Detail) -> String {
    let differs = |column: &&ColumnDiff| column.changed + column.within > 0;
    let differing: Vec<&ColumnDiff> = diff.columns.iter().filter(differs).collect();
    let names = differing.iter().map(|column| column.name.chars().count());
    let width = names.max().unwrap_or(0).max("column".len());
    let about = context! {
        diff => Serde(diff), equal => diff.equal.map(Equal::says), differing => Serde(&differing), width,
        full => detail == Detail::Full, cells => cells(diff),
    };
    let mut environment = crate::text::environment();
    // Keys of an answer that is not asked for are not there.
    environment.set_undefined_behavior(UndefinedBehavior::Lenient);
    environment.add_filter("short", short);
    environment
        .render_str(include_str!("text.txt"), about)
        .expect("a template that names what it is given")
}

/// The cells that differ of each of the worst rows.
fn cells(diff: &TableDiff) -> Vec<Vec<String>> {
    let rows = diff.worst.iter();
    rows.map(|row| row.cells.iter().map(cell).collect())
        .collect()
}

/// The cell of a row that changed most; one that has a number before one that appeared or vanished.
pub fn headline(row: &super::WorstRow) -> String {
    let first = row
        .cells
        .iter()
        .find(|cell| cell.difference.is_some())
        .or(row.cells.first());
    first.map(cell).unwrap_or_default()
}

/// `x_mm 1.25 -> 1.5 mm (+0.25, 3.1 sigma)`.
fn cell(cell: &WorstCell) -> String {
    let show = |value: &serde_json::Value| match value {
        serde_json::Value::String(text) => {
            format!("{:?}", text.chars().take(40).collect::<String>())
        }
        serde_json::Value::Number(number) => {
            number.as_f64().map_or_else(|| number.to_string(), exact)
        }
        other => other.to_string(),
    };
    let sign = |difference: f64| if difference > 0.0 { "+" } else { "" };
    let difference = cell.difference;
    let difference = difference.map(|difference| sign(difference).to_string() + &short(difference));
    let sigmas = cell.sigmas.map(|sigmas| short(sigmas) + " sigma");
    let notes: Vec<String> = difference.into_iter().chain(sigmas).collect();
    let (a, b) = (show(&cell.a), show(&cell.b));
    let mut text = format!("{} {a} -> {b}", cell.column);
    if !cell.unit.is_empty() {
        text += &format!(" {}", cell.unit);
    }
    if !notes.is_empty() {
        text += &format!(" ({})", notes.join(", "));
    }
    text
}

/// Three significant digits.
pub fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.2e}")
    } else {
        let decimals = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.decimals$}")
    }
}

/// As many digits as the value has, up to 8 significant ones.
fn exact(value: f64) -> String {
    let size = value.abs();
    if value != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.6e}");
    }
    let decimals = if value == 0.0 {
        0
    } else {
        (7 - size.log10().floor() as i32).clamp(0, 12) as usize
    };
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// Tables compared, each under its name, as one self-contained page with a title. Names and texts come from files: the template escapes
/// all of them.
pub fn html(title: &str, notes: &[String], tables: &[(String, TableDiff)]) -> Result<String> {
    let bug = |e: minijinja::Error| Error::Bug(format!("diff page: {e}"));
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_filter("short", short);
    environment
        .add_template("page", include_str!("page.html"))
        .map_err(bug)?;
    let tables: Vec<Value> = tables
        .iter()
        .map(|(name, diff)| {
            context! { name, cells => cells(diff), same => diff.is_same(), diff => Value::from(Serde(diff)) }
        })
        .collect();
    let template = environment.get_template("page").map_err(bug)?;
    template
        .render(context! { title, notes => Value::from(Serde(notes)), tables })
        .map_err(bug)
}
