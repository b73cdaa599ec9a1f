//! Every stage with its tables and settings, from the registry and its JSON Schema.

use super::blocks::cell;
use super::settings::{definition, kind, links, settings};
use calib::pipeline::json_schema;
use calib::stage::{Arity, Port, STAGES};
use serde_json::Value;
use std::collections::BTreeSet;

pub fn text() -> String {
    let schema: Value = serde_json::from_str(&json_schema(STAGES)).expect("a schema");
    let definitions = &schema["definitions"];
    let mut text = String::from("| stage | what it does |\n|---|---|\n");
    for stage in STAGES {
        text.push_str(&format!(
            "| [`{0}`](#{0}) | {1} |\n",
            stage.name,
            cell(stage.summary)
        ));
    }
    let mut wanted = BTreeSet::new();
    for (stage, entry) in STAGES.iter().zip(
        schema["properties"]["stages"]["items"]["oneOf"]
            .as_array()
            .expect("stages"),
    ) {
        assert_eq!(entry["title"], stage.name);
        let name = entry["properties"]["with"]["$ref"]
            .as_str()
            .expect("settings")
            .trim_start_matches("#/definitions/");
        text.push_str(&format!(
            "\n### {}\n\n{}.\n\n",
            stage.name,
            sentence(stage.summary)
        ));
        text.push_str(&format!(
            "Reads {}. Writes {}.\n\n",
            ports(&(stage.reads)()),
            ports(&(stage.writes)())
        ));
        let own = &definitions[name];
        text.push_str(&settings(own));
        links(own, &mut wanted);
    }
    text.push_str(&structures(definitions, wanted));
    text
}

/// What settings are made of, until nothing is left that is not said.
fn structures(definitions: &Value, mut wanted: BTreeSet<String>) -> String {
    let mut said: BTreeSet<String> = BTreeSet::new();
    while let Some(name) = wanted.iter().find(|name| !said.contains(*name)).cloned() {
        links(&definitions[&name], &mut wanted);
        said.insert(name);
    }
    let mut text = String::from(
        "\n### Parts of settings\n\nWhat the settings above refer to, in the order of the alphabet.\n",
    );
    for name in said {
        let own = &definitions[&name];
        let body = definition(own);
        let says = own["description"]
            .as_str()
            .map(cell)
            .unwrap_or_else(|| kind(own));
        text.push_str(&format!("\n#### {name}\n\n{says}\n\n{body}"));
    }
    text
}

fn sentence(summary: &str) -> String {
    let mut letters = summary.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

fn ports(ports: &[Port]) -> String {
    let say = |port: &Port| {
        let name = if port.name == port.kind {
            String::new()
        } else {
            format!("`{}`: ", port.name)
        };
        let how = match port.arity {
            Arity::One => "",
            Arity::Optional => " (if there is one)",
            Arity::Every => " (of every earlier stage)",
        };
        format!("{name}[{0}](../schemas/README.md#{0}){how}", port.kind)
    };
    if ports.is_empty() {
        "no table".into()
    } else {
        ports.iter().map(say).collect::<Vec<_>>().join(", ")
    }
}
