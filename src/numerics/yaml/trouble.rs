//! One fault of a YAML value: path, place and message; built from the inside out while serde unwinds.

use super::Mark;
use super::node::join;
use crate::error::{Fault, counted, instead};
use serde::de::{self, Expected, Unexpected};
use std::fmt;

/// A fault of a value, before it is known in which file.
#[derive(Debug, Clone)]
pub struct Trouble {
    /// Path below the value that was read.
    pub path: String,
    /// Where it stands, if that is known.
    pub mark: Option<Mark>,
    /// What is wrong, and what is allowed.
    pub message: String,
    /// The key that is missing, where that is the fault.
    pub(super) missing: Option<&'static str>,
    /// What to look for where serde lost the place.
    pub(super) clue: Option<Clue>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Clue {
    /// A value that is not what was expected.
    Expected(String),
    /// A key that is not known.
    Key(String),
    /// A word that is not among those allowed.
    Word(String),
}

impl Trouble {
    /// A fault of the value itself.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            path: String::new(),
            mark: None,
            message: message.into(),
            missing: None,
            clue: None,
        }
    }
    /// A key that is not among those allowed.
    pub fn unknown_key(found: &str, allowed: &[&str]) -> Self {
        let message = if allowed.is_empty() {
            "unknown key; this block has no settings".into()
        } else {
            format!("unknown key{}", instead(found, allowed))
        };
        Self {
            clue: Some(Clue::Key(found.into())),
            ..Self::new(message)
        }
    }
    /// Whether the fault is a key that is not known.
    pub fn is_unknown_key(&self) -> bool {
        matches!(self.clue, Some(Clue::Key(_)))
    }
    /// Sets the place unless an inner one is known.
    pub fn at(mut self, mark: Mark) -> Self {
        self.mark.get_or_insert(mark);
        self
    }
    /// Puts the path of an outer value in front.
    pub fn below(mut self, path: &str) -> Self {
        self.path = join(path, &self.path);
        self
    }
    /// `pipeline.yaml:12:9: stages[2].with.every: message`.
    pub fn fault(self, file: &str) -> Fault {
        let place = match self.mark {
            Some(Mark::Line { line, column }) => format!("{file}:{line}:{column}"),
            Some(Mark::CommandLine) => "--set".into(),
            Some(Mark::Unknown) | None => file.into(),
        };
        Fault::new(
            if self.path.is_empty() {
                place
            } else {
                format!("{place}: {}", self.path)
            },
            self.message,
        )
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
impl std::error::Error for Trouble {}

impl de::Error for Trouble {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }
    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let expected = wanted(&expected.to_string());
        let message = format!("expected {expected}; found {}", given(found));
        Self {
            clue: Some(Clue::Expected(expected)),
            ..Self::new(message)
        }
    }
    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }
    fn invalid_length(found: usize, expected: &dyn Expected) -> Self {
        Self::new(format!(
            "expected {}; found {found}",
            wanted(&expected.to_string())
        ))
    }
    fn unknown_variant(found: &str, allowed: &'static [&'static str]) -> Self {
        let message = format!("unknown value `{found}`{}", instead(found, allowed));
        Self {
            clue: Some(Clue::Word(found.into())),
            ..Self::new(message)
        }
    }
    fn unknown_field(found: &str, allowed: &'static [&'static str]) -> Self {
        Self::unknown_key(found, allowed)
    }
    fn missing_field(field: &'static str) -> Self {
        Self {
            missing: Some(field),
            ..Self::new(format!("missing key `{field}`"))
        }
    }
    fn duplicate_field(field: &'static str) -> Self {
        Self::new(format!("key `{field}` is given twice"))
    }
}

/// What serde calls a type, for people who do not write Rust.
fn wanted(expected: &str) -> String {
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a boolean" => "`true` or `false`".into(),
        "a string" | "string" | "path string" => "text".into(),
        "a sequence" => "a list".into(),
        "a map" | "map" => "a block of keys".into(),
        other if other.starts_with("a nonzero u") => "a positive whole number, e.g. 4".into(),
        other if other.starts_with("a nonzero ") => "a whole number other than 0".into(),
        other if other.starts_with("struct ") => "a block of keys".into(),
        other => match other.strip_prefix("an array of length ") {
            Some(length) => format!("a list of {}", counted(length, "value")),
            None => other.into(),
        },
    }
}

fn given(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(value) => value.to_string(),
        Unexpected::Signed(value) => value.to_string(),
        Unexpected::Float(value) => format!("{value:?}"),
        Unexpected::Str(text) => format!("`{text}`"),
        Unexpected::Unit | Unexpected::Option => "nothing".into(),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a block of keys".into(),
        other => other.to_string(),
    }
}
