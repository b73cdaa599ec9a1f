//! Templates to HTML: one head for every page, and no name that does not exist.

use super::number::{count, fixed, mm, significant};
use crate::error::{Error, Result};
use minijinja::{Environment, UndefinedBehavior, value::Serde};
use serde_json::Value;

/// The page of a template, behind the head, for which it has `title`, and where they are not those of the report `style` and `policy` (what
/// the page may load and run). Fails where the template asks for what the page does not have.
pub(super) fn render(name: &str, template: &str, mut page: Value) -> Result<String> {
    let usual = [
        ("version", env!("CARGO_PKG_VERSION")),
        ("policy", ""),
        ("style", include_str!("report.css")),
    ];
    for (key, value) in usual {
        if page.get(key).is_none() {
            page[key] = value.into();
        }
    }
    let text = format!("{}{template}", include_str!("head.html"));
    let mut environment = Environment::new();
    // A name in the template that does not exist is a bug, not an empty cell.
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    // Figures of rows; of none an empty cell.
    let filled = |value: Option<String>| value.unwrap_or_default();
    environment.add_filter("mm", move |value: Option<f64>| filled(value.map(mm)));
    environment.add_filter("count", count);
    environment.add_filter("fixed", move |value: Option<f64>, decimals: usize| {
        filled(value.map(|value| fixed(value, decimals)))
    });
    environment.add_filter("significant", significant);
    environment
        .add_template(name, &text)
        .and_then(|()| environment.get_template(name)?.render(Serde(&page)))
        .map_err(|error| Error::Bug(format!("template {name}: {error:#}")))
}

/// A statement as a sentence.
pub(super) fn sentence_case(statement: &str) -> String {
    let mut letters = statement.chars();
    let first = letters
        .next()
        .map(|letter| letter.to_uppercase().to_string())
        .unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}
