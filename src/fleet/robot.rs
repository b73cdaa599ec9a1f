//! One robot of a fleet: its name, its groups and what it sets in the pipeline.

use super::file::Groups;
use crate::pipeline::Override;
use serde_json::Value;
use std::collections::BTreeMap;

/// One robot. Its name is data from outside: never a path, never a command.
#[derive(Debug, Clone)]
pub struct FleetRobot {
    /// Unique in the fleet.
    pub(crate) name: String,
    /// Its labels.
    pub(crate) groups: Groups,
    /// Later ones win.
    pub(crate) sets: Vec<Override>,
    /// Why its data cannot be reached at all.
    pub(crate) unreadable: Option<String>,
}

impl FleetRobot {
    pub(super) fn new(name: String) -> Self {
        Self {
            name,
            groups: Groups::default(),
            sets: Vec::new(),
            unreadable: None,
        }
    }

    /// A name for paths: letters and digits of the robot's name, then its hash.
    pub(crate) fn handle(&self) -> String {
        let kept = self
            .name
            .chars()
            .filter(char::is_ascii_alphanumeric)
            .take(24)
            .collect::<String>();
        let hash = blake3::hash(self.name.as_bytes()).to_hex();
        if kept.is_empty() {
            hash[..16].to_string()
        } else {
            format!("{kept}-{}", &hash[..16])
        }
    }

    /// Sets a path or another text.
    pub(super) fn set_text(&mut self, target: &str, text: &str) {
        self.sets.push(Override {
            target: target.into(),
            value: quoted(text),
        });
    }
    pub(super) fn set_values(&mut self, values: &BTreeMap<String, Value>) {
        self.sets
            .extend(values.iter().map(|(target, value)| Override {
                target: target.clone(),
                value: written(value),
            }));
    }
}

/// Text as YAML, whatever is in it.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            ' '..='~' => out.push(c),
            c => out.push_str(&format!("\\U{:08X}", u32::from(c))),
        }
    }
    out.push('"');
    out
}

/// A value as YAML on one line.
fn written(value: &Value) -> String {
    match value {
        Value::String(text) => quoted(text),
        Value::Array(items) => format!(
            "[{}]",
            items.iter().map(written).collect::<Vec<_>>().join(", ")
        ),
        Value::Object(map) => {
            let entry =
                |(key, value): (&String, &Value)| format!("{}: {}", quoted(key), written(value));
            format!(
                "{{{}}}",
                map.iter().map(entry).collect::<Vec<_>>().join(", ")
            )
        }
        plain => plain.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_survives_the_way_through_yaml() {
        for text in [
            "r'1\"",
            "a\nb",
            "$(reboot)",
            "../x",
            "# no: [comment",
            "\u{85}\u{2028}\u{1f916}",
            "",
            "null",
            "1e3",
            "tab\there",
        ] {
            let (node, troubles) = crate::yaml::parse(&quoted(text));
            assert!(troubles.is_empty(), "{text:?}: {troubles:?}");
            assert_eq!(node.and_then(|node| node.text()).as_deref(), Some(text));
        }
    }
}
