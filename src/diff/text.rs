//! A comparison as a short text: counts, columns that differ, the worst rows; never a dump.

use super::{ColumnDiff, TableDiff, WorstCell};
use crate::error::{Error, Result, counted};
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};

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
    let rows = &diff.rows;
    if let Some(equal) = diff.equal {
        return format!("same: {}, {}\n", counted(rows.same, "row"), equal.says());
    }
    let mut text = format!(
        "A  {}  {}\nB  {}  {}\n",
        diff.a.path,
        counted(diff.a.rows, "row"),
        diff.b.path,
        counted(diff.b.rows, "row")
    );
    for finding in &diff.findings {
        let column = if finding.column.is_empty() {
            String::new()
        } else {
            format!(" {}", finding.column)
        };
        text.push_str(&format!("{}{column}: {}\n", finding.what, finding.says));
    }
    text.push_str(&format!(
        "rows by {}: {} same, {} within tolerance, {} changed",
        diff.key.join(", "),
        rows.same,
        rows.within_tolerance,
        rows.changed
    ));
    text.push_str(&format!(
        ", {} only in A, {} only in B\n",
        rows.only_a, rows.only_b
    ));
    if diff.duplicates() > 0 {
        text.push_str(&format!(
            "duplicate keys: {}, {} of A, {} of B, not compared; --occurrence pairs them in their order\n",
            counted(rows.duplicate_keys, "key"),
            counted(rows.duplicate_a, "row"),
            rows.duplicate_b
        ));
    }
    text.push_str(&columns(&diff.columns));
    if detail == Detail::Stat {
        return text;
    }
    if !diff.worst.is_empty() {
        text.push_str(&format!(
            "worst {} of {}\n",
            diff.worst.len(),
            counted(rows.changed, "changed row")
        ));
    }
    for row in &diff.worst {
        const SHOWN: usize = 3; // more do not fit on a line
        let cells: Vec<String> = row.cells.iter().take(SHOWN).map(cell).collect();
        let more = if row.cells.len() > SHOWN {
            format!("; {}", counted(row.cells.len() - SHOWN, "more column"))
        } else {
            String::new()
        };
        text.push_str(&format!("  {}: {}{more}\n", row.key, cells.join("; ")));
    }
    for (keys, what) in [
        (&diff.examples.only_a, "only in A"),
        (&diff.examples.only_b, "only in B"),
        (&diff.examples.duplicate, "duplicate"),
    ] {
        if !keys.is_empty() {
            text.push_str(&format!("{what}, e.g. {}\n", keys.join(" | ")));
        }
    }
    text
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
    let unit = if cell.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", cell.unit)
    };
    let mut notes = Vec::new();
    notes.extend(cell.difference.map(|difference| {
        format!(
            "{}{}",
            if difference > 0.0 { "+" } else { "" },
            short(difference)
        )
    }));
    notes.extend(cell.sigmas.map(|sigmas| format!("{} sigma", short(sigmas))));
    let notes = if notes.is_empty() {
        String::new()
    } else {
        format!(" ({})", notes.join(", "))
    };
    format!(
        "{} {} -> {}{unit}{notes}",
        cell.column,
        show(&cell.a),
        show(&cell.b)
    )
}

fn columns(columns: &[ColumnDiff]) -> String {
    let differing: Vec<&ColumnDiff> = columns
        .iter()
        .filter(|column| column.changed + column.within > 0)
        .collect();
    let equal = columns.len() - differing.len();
    if differing.is_empty() {
        return format!("columns: all {equal} equal\n");
    }
    let name = differing
        .iter()
        .map(|column| column.name.chars().count())
        .max()
        .unwrap_or(0)
        .max("column".len());
    let mut text = format!(
        "{:name$}  {:>6}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  largest at\n",
        "column", "unit", "changed", "within", "max", "rms", "bias", "p95", "max sigma"
    );
    for column in differing {
        let of = |pick: fn(&super::DifferenceStatistics) -> f64| {
            column
                .statistics
                .as_ref()
                .map_or_else(String::new, |found| short(pick(found)))
        };
        text.push_str(&format!(
            "{:name$}  {:>6}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}  {}\n",
            column.name,
            column.unit,
            column.changed,
            column.within,
            of(|found| found.max),
            of(|found| found.rms),
            of(|found| found.bias),
            of(|found| found.p95),
            column.max_sigmas.map_or_else(String::new, short),
            column.worst_key.as_deref().unwrap_or("")
        ));
    }
    if equal > 0 {
        text.push_str(&format!("equal: {}\n", counted(equal, "more column")));
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
    let cells = |diff: &TableDiff| -> Vec<Vec<String>> {
        let rows = diff.worst.iter();
        rows.map(|row| row.cells.iter().map(cell).collect())
            .collect()
    };
    let tables: Vec<minijinja::Value> = tables
        .iter()
        .map(|(name, diff)| {
            context! { name, cells => cells(diff), same => diff.is_same(), diff => minijinja::Value::from(Serde(diff)) }
        })
        .collect();
    let template = environment.get_template("page").map_err(bug)?;
    template
        .render(context! { title, notes => minijinja::Value::from(Serde(notes)), tables })
        .map_err(bug)
}
