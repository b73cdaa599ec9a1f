//! Lines for a terminal as templates, filled with what `--json` prints.

use crate::error::{counted, visible};
use minijinja::syntax::SyntaxConfig;
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
