//! Lines for a terminal as templates, filled with what `--json` prints.

use crate::error::{counted, visible};
use crate::figures::{deviation, measured};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Value, ValueKind};
use minijinja::{Environment, UndefinedBehavior};

/// Templates of plain text: what has no name is a bug, columns of tables are set left and right.
pub(crate) fn environment() -> Environment<'static> {
    let mut environment = Environment::new();
    // Lines of tags alone leave no line.
    let syntax = SyntaxConfig::builder()
        .trim_blocks(true)
        .lstrip_blocks(true)
        .keep_trailing_newline(true)
        .build();
    environment.set_syntax(syntax.expect("the usual delimiters"));
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_filter("counted", |count: u64, what: &str| counted(count, what));
    environment.add_filter("left", |text: &str, width: usize| format!("{text:width$}"));
    environment.add_filter("right", |value: minijinja::Value, width: usize| {
        format!("{:>width$}", value.to_string())
    });
    environment
}

/// A template, filled.
pub(crate) fn filled(template: &'static str, about: minijinja::Value) -> String {
    let mut environment = environment();
    environment.add_filter("words", |name: &str| name.replace('_', " "));
    // A number that is not finite is null in JSON.
    environment.add_filter("fixed", |value: Option<f64>, decimals: usize| {
        format!("{:.decimals$}", value.unwrap_or(f64::INFINITY))
    });
    environment.add_filter("figure", |value: Option<f64>| {
        value.map_or_else(|| "-".into(), |value| format!("{value:.3}"))
    });
    environment.add_filter("measured", |value: f64, sigma: Option<f64>| {
        measured(value, sigma)
    });
    environment.add_filter("deviation", |sigma: f64, value: f64| {
        deviation(sigma, value)
    });
    environment.add_filter("columns", columns);
    environment.add_filter("brief", brief);
    environment.add_filter("visible", |text: &str| visible(text));
    environment.add_filter("scientific", |value: Option<f64>| {
        format!("{:.2e}", value.unwrap_or(f64::INFINITY))
    });
    environment.add_filter("visible_from", |sigma: Option<f64>| {
        format!("{:.2e}", 3.0 * sigma.unwrap_or(f64::INFINITY))
    });
    environment
        .render_str(template, about)
        .expect("a template that names what it is given")
}

/// Rows below their heads, columns separated by blanks: each is a head and the name of what it shows, `>8mean=mean_mm`. A head says how a column is
/// aligned (`<`, `>`), how wide it is at least, and with `|` that a line stands before it; a blank in it is one that does not break. Lengths
/// have four decimals, and `none` stands for what is missing.
fn columns(rows: Vec<Value>, columns: &str, none: &str) -> String {
    let digits = |c: char| c.is_ascii_digit();
    let cell = |value: &Value| match value.kind() {
        ValueKind::Undefined | ValueKind::None => none.to_string(),
        ValueKind::Number if !value.is_integer() => {
            f64::try_from(value.clone()).map_or_else(|_| none.to_string(), |mm| format!("{mm:.4}"))
        }
        _ => value.to_string(),
    };
    let mut lines = vec![String::new(); rows.len() + 1];
    let mut columns = columns
        .split(' ')
        .filter_map(|column| column.split_once('='))
        .peekable();
    while let Some((head, name)) = columns.next() {
        let title = head[1..].trim_start_matches(digits).trim_start_matches('|');
        let of_rows = rows.iter().map(|row| {
            let value = row.get_attr(name);
            value.map_or_else(|_| none.into(), |value| cell(&value))
        });
        let cells: Vec<String> = std::iter::once(title.replace('\u{a0}', " "))
            .chain(of_rows)
            .collect();
        let least = head[1..].split(|c| !digits(c)).next();
        let least = least.and_then(|least| least.parse().ok()).unwrap_or(0);
        let widths = cells.iter().map(|cell| cell.chars().count());
        let width = widths.max().unwrap_or(0).max(least);
        let before = if head.contains('|') { " | " } else { "  " };
        for (line, cell) in lines.iter_mut().zip(&cells) {
            *line += &match (head.starts_with('<'), columns.peek().is_none()) {
                (true, true) if cell.is_empty() => String::new(),
                (true, true) => format!("{before}{cell}"),
                (true, false) => format!("{before}{cell:width$}"),
                (false, _) => format!("{before}{cell:>width$}"),
            };
        }
    }
    lines.join("\n")
}

fn brief(value: &str) -> String {
    let cut: String = value.chars().take(60).collect();
    // Of hashes the beginning says enough.
    let is_hash = value.len() == 64 && value.chars().all(|c| c.is_ascii_hexdigit());
    match () {
        () if is_hash => value[..12].into(),
        () if cut.len() < value.len() => format!("{cut}…"),
        () => cut,
    }
}
