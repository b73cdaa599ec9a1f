//! YAML as a tree whose nodes know their line, and trees as typed values with every fault at its place.
//!
//! The only file that knows the YAML crate. Booleans are `true` and `false` alone; a key given twice is a fault.

mod node;
mod trouble;
mod typed;

pub(crate) use node::join;
pub use node::{Mark, Node, YamlValue};
pub use trouble::Trouble;
pub use typed::typed;

use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::options::{DuplicateKeyPolicy, NonFiniteFloatPolicy};
use serde_saphyr::{Location, Spanned};
use std::fmt;

/// A text as YAML in double quotes; JSON's escapes are YAML's.
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Parses one YAML document; what can be read is returned even where there are faults.
pub fn parse(text: &str) -> (Option<Node>, Vec<Trouble>) {
    let mut troubles = Vec::new();
    let tree = read(text, DuplicateKeyPolicy::Error).or_else(|trouble| {
        troubles.push(trouble);
        // The rest of the file may have faults of its own.
        read(text, DuplicateKeyPolicy::FirstWins)
    });
    let mut node = tree.ok();
    if let Some(node) = &mut node {
        node.fill_raw(text);
    }
    (node, troubles)
}

fn read(text: &str, duplicate_keys: DuplicateKeyPolicy) -> Result<Node, Trouble> {
    let options = serde_saphyr::options! {
        strict_booleans: true,
        duplicate_keys: duplicate_keys,
        non_finite_float_policy: NonFiniteFloatPolicy::PassThrough,
        with_snippet: false,
    };
    serde_saphyr::from_str_with_options::<Spanned<Tree>>(text, options)
        .map(Tree::node)
        .map_err(|error| {
            let formatted = error.render_with_formatter(&serde_saphyr::UserMessageFormatter);
            let line = error
                .location()
                .and_then(|location| text.lines().nth(location.line().saturating_sub(1) as usize));
            let message = line
                .and_then(bare_variable)
                .unwrap_or_else(|| in_words(&formatted));
            Trouble::new(message).at(error.location().map_or(Mark::Unknown, mark))
        })
}

/// What to write where a variable without quotes breaks the syntax of its line.
fn bare_variable(line: &str) -> Option<String> {
    let quotes = |before: &str| before.matches(['"', '\'']).count();
    let (at, _) = line
        .match_indices("${")
        .find(|(at, _)| quotes(&line[..*at]) % 2 == 0)?;
    let (variable, _) = line[at..].split_once('}')?;
    Some(format!(
        "inside {{}} and [] a variable stands in quotes: \"{variable}}}\""
    ))
}

/// One line, in our words where it matters; the place is printed once, in front of it.
fn in_words(message: &str) -> String {
    let first = message.lines().next().unwrap_or_default();
    let first = first
        .split(" at line ")
        .next()
        .unwrap_or(first)
        .trim_start_matches("error: ");
    let twice = first
        .split_once("duplicate mapping key: ")
        .and_then(|(_, tail)| tail.strip_suffix(" not allowed here"));
    if let Some(key) = twice {
        return format!("key `{key}` is given twice in this block");
    }
    match first
        .strip_prefix("line ")
        .and_then(|tail| tail.split_once(": "))
    {
        Some((_, message)) => message.into(),
        None => first.into(),
    }
}

fn mark(location: Location) -> Mark {
    match (location.line(), location.column()) {
        (0, _) => Mark::Unknown,
        (line, column) => Mark::Line { line, column },
    }
}

/// The value of a node while the parser still owns its place.
struct Tree {
    value: YamlValue,
}

impl Tree {
    fn node(spanned: Spanned<Tree>) -> Node {
        let span = spanned.defined.span();
        let bytes = span.byte_offset().zip(span.byte_len());
        Node {
            bytes,
            ..Node::new(spanned.value.value, mark(spanned.referenced))
        }
    }
}

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer
            .deserialize_any(TreeVisitor)
            .map(|value| Tree { value })
    }
}

struct TreeVisitor;

impl<'de> Visitor<'de> for TreeVisitor {
    type Value = YamlValue;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a YAML value")
    }
    fn visit_unit<E: de::Error>(self) -> Result<YamlValue, E> {
        Ok(YamlValue::Null)
    }
    fn visit_none<E: de::Error>(self) -> Result<YamlValue, E> {
        Ok(YamlValue::Null)
    }
    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<YamlValue, D::Error> {
        deserializer.deserialize_any(self)
    }
    fn visit_bool<E: de::Error>(self, value: bool) -> Result<YamlValue, E> {
        Ok(YamlValue::Bool(value))
    }
    fn visit_i64<E: de::Error>(self, value: i64) -> Result<YamlValue, E> {
        Ok(YamlValue::Integer(value.into()))
    }
    fn visit_u64<E: de::Error>(self, value: u64) -> Result<YamlValue, E> {
        Ok(YamlValue::Integer(value.into()))
    }
    fn visit_i128<E: de::Error>(self, value: i128) -> Result<YamlValue, E> {
        Ok(YamlValue::Integer(value))
    }
    fn visit_f64<E: de::Error>(self, value: f64) -> Result<YamlValue, E> {
        Ok(YamlValue::Float(value))
    }
    fn visit_str<E: de::Error>(self, value: &str) -> Result<YamlValue, E> {
        Ok(YamlValue::Text(value.into()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<YamlValue, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = access.next_element::<Spanned<Tree>>()? {
            items.push(Tree::node(item));
        }
        Ok(YamlValue::List(items))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<YamlValue, A::Error> {
        let mut entries = Vec::new();
        while let Some(key) = access.next_key::<Spanned<String>>()? {
            let value = access.next_value::<Spanned<Tree>>()?;
            entries.push((key.value, mark(key.referenced), Tree::node(value)));
        }
        Ok(YamlValue::Map(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        every: std::num::NonZeroU32,
        #[serde(default)]
        ratio: f64,
        #[serde(default)]
        label: String,
        #[serde(default)]
        list: Vec<f64>,
    }

    fn faults(text: &str) -> Vec<String> {
        let (node, mut troubles) = parse(text);
        if let Some(node) = node {
            troubles.extend(typed::<Sample>(&node).err().unwrap_or_default());
        }
        troubles
            .into_iter()
            .map(|trouble| trouble.fault("f.yaml").to_string())
            .collect()
    }

    #[test]
    fn every_fault_of_a_block_is_reported_with_its_line() {
        assert_eq!(
            faults("every: four\nration: 2\nlist: [1, x]\n"),
            [
                "f.yaml:1:8: every: expected a positive whole number, e.g. 4; found `four`",
                "f.yaml:2:1: ration: unknown key; did you mean `ratio`? Allowed: every, ratio, label, list",
                "f.yaml:3:11: list[1]: expected a number; found `x`",
            ]
        );
    }

    #[test]
    fn a_number_beyond_any_quantity_is_refused_at_its_place() {
        let text = "every: 4\nratio: .1e309\nlist: [1e15, -1e16]\n";
        let expected = |number: &str, place: &str| {
            format!("f.yaml:{place}: {number} is no quantity of a cell; expected at most 1e15")
        };
        assert_eq!(
            faults(text),
            [
                expected("1e308", "2:8: ratio"),
                expected("-1e16", "3:14: list[1]")
            ]
        );
    }

    /// serde reads such an enum through a buffer without places.
    #[derive(Debug, serde::Deserialize)]
    #[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
    #[expect(dead_code, reason = "only its faults are looked at")]
    enum Tagged {
        Every { n: u32, list: Vec<f64> },
    }

    #[test]
    fn faults_inside_variants_have_their_place() {
        let faults = |text: &str| -> Vec<String> {
            let troubles = typed::<Vec<Tagged>>(&parse(text).0.unwrap()).unwrap_err();
            troubles
                .into_iter()
                .map(|trouble| trouble.fault("f").to_string())
                .collect()
        };
        assert_eq!(
            faults("- {by: every, n: x, list: []}"),
            ["f:1:18: [0].n: expected a whole number, 0 or more; found `x`"]
        );
        assert_eq!(
            faults("- {by: every, n: 1, list: [1, b]}"),
            ["f:1:31: [0].list[1]: expected a number; found `b`"]
        );
        assert_eq!(
            faults("- {by: evry, n: 1, list: []}"),
            ["f:1:8: [0].by: unknown value `evry`; did you mean `every`? Allowed: every"]
        );
        let unknown = "- {by: every, n: 1, list: [], lst: 2}";
        assert_eq!(
            faults(unknown),
            ["f:1:31: [0].lst: unknown key; did you mean `list`? Allowed: n, list"]
        );
    }

    #[test]
    fn a_key_given_twice_and_the_other_faults_come_together() {
        let faults = faults("every: 4\nevery: 5\nratio: yes\n");
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(
            faults[0].starts_with("f.yaml:2:1: ") && faults[0].contains("every"),
            "{faults:?}"
        );
        assert_eq!(
            faults[1],
            "f.yaml:3:8: ratio: expected a number; found `yes`"
        );
    }

    #[test]
    fn text_keeps_the_spelling_of_numbers() {
        let (node, _) = parse("every: 4\nlabel: 007\n");
        assert_eq!(typed::<Sample>(&node.unwrap()).unwrap().label, "007");
        assert_eq!(
            faults("every: 010"),
            ["f.yaml:1:8: every: expected a positive whole number, e.g. 4; found 10.0"]
        );
    }

    #[test]
    fn a_variable_without_quotes_inside_braces_says_what_to_write() {
        let message = "f.yaml:2:9: inside {} and [] a variable stands in quotes: \"${u}\"";
        assert_eq!(
            faults("every: 4\nlist: [${u}]\n")
                .last()
                .map(String::as_str),
            Some(message)
        );
        let messages = faults("every: 4\nlist: {a: \"${u}\", b: ${name}}\n");
        assert!(
            messages[0].ends_with("stands in quotes: \"${name}\""),
            "{messages:?}"
        );
    }

    #[test]
    fn broken_syntax_is_one_fault_with_its_line() {
        let faults = faults("every: [1, 2\nlabel: x\n");
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].starts_with("f.yaml:"), "{faults:?}");
    }
}
