//! The JSON Schema (draft-07) of the pipeline's YAML, from the stages' own types.

use super::spec::FORMAT;
use crate::stage::{Arity, StageEntry};
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

/// The schema as pretty JSON with a line end, as `schemas/pipeline.v1.schema.json` holds it.
pub fn json_schema(stages: &[StageEntry]) -> String {
    let mut generator = SchemaSettings::draft07().into_generator();
    let kinds: Vec<Value> = stages
        .iter()
        .map(|entry| {
            let settings = (entry.schema)(&mut generator).to_value();
            stage(entry, settings)
        })
        .collect();
    let definitions = Value::Object(generator.take_definitions(true));
    let schema = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "calib pipeline",
        "type": "object",
        "required": ["calib", "name", "stages"],
        "additionalProperties": false,
        "properties": {
            "calib": { "const": FORMAT, "description": "Format of this file." },
            "name": {
                "type": "string", "pattern": "^[A-Za-z0-9][A-Za-z0-9_-]*$",
                "description": "Name of the pipeline; part of the paths of its tables."
            },
            "seed": { "type": "integer", "minimum": 0, "default": 0, "description": "Every random number of the run comes from it." },
            "variables": {
                "type": "object", "additionalProperties": { "type": ["string", "number", "boolean", "null"] },
                "description": "Used as ${name} in the stages; `--set name=value` overrides. null: must be given by --set."
            },
            "stages": { "type": "array", "minItems": 1, "items": { "oneOf": kinds }, "description": "The steps, in order." }
        },
        "definitions": definitions
    });
    // Keys in order, so that the file does not depend on how its parts were built.
    let text = serde_json::to_string_pretty(&sorted(schema)).expect("a schema is plain data");
    text + "\n"
}

fn stage(entry: &StageEntry, settings: Value) -> Value {
    let mut reads = Map::new();
    for port in (entry.reads)() {
        let name = json!({ "type": "string", "description": format!("Id of the stage whose `{}` table is read.", port.kind) });
        let shape = match port.arity {
            Arity::Every => json!({ "anyOf": [name, { "type": "array", "items": name }] }),
            Arity::One | Arity::Optional => name,
        };
        reads.insert(port.name.into(), shape);
    }
    json!({
        "title": entry.name,
        "description": entry.summary,
        "type": "object",
        "required": ["uses"],
        "additionalProperties": false,
        "properties": {
            "id": {
                "type": "string", "pattern": "^[A-Za-z0-9][A-Za-z0-9_-]*$",
                "description": "Name of this stage in the pipeline; as `uses` if not given."
            },
            "uses": { "const": entry.name, "description": entry.summary },
            "with": settings,
            "reads": {
                "type": "object", "additionalProperties": false, "properties": reads,
                "description": "Where inputs come from, where it is not the latest earlier stage that writes the table."
            }
        }
    })
}

fn sorted(value: Value) -> Value {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<(String, Value)> = map.into_iter().map(|(key, value)| (key, sorted(value))).collect();
            entries.sort_by(|left, right| left.0.cmp(&right.0));
            Value::Object(entries.into_iter().collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(sorted).collect()),
        plain => plain,
    }
}
