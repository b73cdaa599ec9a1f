//! Templates to HTML: one head for every page, and no name that does not exist.

use crate::error::{Error, Result};
use minijinja::{Environment, UndefinedBehavior, value::Serde};
use serde::Serialize;

/// The page of a template, behind the head, for which it has `title`, `style`, `version` and `policy` (what the page may do beside
/// showing itself). Fails where the template asks for what the page does not have.
pub(super) fn render(name: &str, template: &str, page: &impl Serialize) -> Result<String> {
    let text = format!("{}{template}", include_str!("head.html"));
    let mut environment = Environment::new();
    // A name in the template that does not exist is a bug, not an empty cell.
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment
        .add_template(name, &text)
        .and_then(|()| environment.get_template(name)?.render(Serde(page)))
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
