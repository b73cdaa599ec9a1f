//! Every stage with its tables and settings, from the registry and its JSON Schema.

use super::blocks::cell;
use super::settings::settings;
use calib::pipeline::json_schema;
use calib::stage::{Arity, Port, STAGES};
use serde_json::Value;

pub fn text() -> String {
    let schema: Value = serde_json::from_str(&json_schema(STAGES)).expect("a schema");
    let definitions = &schema["definitions"];
    let mut text = String::from("| stage | what it does |\n|---|---|\n");
    // What a fleet asks of a robot is put in the place of its diagnosis: nobody writes it.
    let is_written = |name: &str| !name.ends_with("_evidence");
    for stage in STAGES.iter().filter(|stage| is_written(stage.name)) {
        text.push_str(&format!(
            "| [`{0}`](#{0}) | {1} |\n",
            stage.name,
            cell(stage.summary)
        ));
    }
    for (stage, entry) in STAGES.iter().zip(
        schema["properties"]["stages"]["items"]["oneOf"]
            .as_array()
            .expect("stages"),
    ) {
        assert_eq!(entry["title"], stage.name);
        if !is_written(stage.name) {
            continue;
        }
        let name = entry["properties"]["with"]["$ref"]
            .as_str()
            .expect("settings")
            .trim_start_matches("#/definitions/");
        text.push_str(&format!("\n### {}\n\n", stage.name));
        text.push_str(&format!(
            "Reads {}. Writes {}.\n\n",
            ports(&(stage.reads)()),
            ports(&(stage.writes)())
        ));
        let ours = &definitions[name];
        text.push_str(&settings(ours, definitions));
    }
    text
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
        format!("{name}[{0}](../schemas/{0}.json){how}", port.kind)
    };
    if ports.is_empty() {
        "no table".into()
    } else {
        ports.iter().map(say).collect::<Vec<_>>().join(", ")
    }
}
