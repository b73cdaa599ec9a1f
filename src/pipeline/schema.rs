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
            stage(entry, with_variables(settings))
        })
        .collect();
    let mut definitions: Map<String, Value> = generator
        .take_definitions(true)
        .into_iter()
        .map(|(name, schema)| (name, with_variables(schema)))
        .collect();
    let variable = json!({ "type": "string", "pattern": "^\\$\\{[A-Za-z0-9_-]+\\}$", "description": "A variable of the pipeline." });
    definitions.insert(VARIABLE.into(), variable);
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

/// The definition of a `${variable}` that stands for a whole value.
const VARIABLE: &str = "calib.variable";

/// Lets a variable stand wherever a number, a boolean or one of a few words is expected; text may hold one anyway.
fn with_variables(schema: Value) -> Value {
    let Value::Object(map) = schema else {
        return schema;
    };
    let members = |key: &str| {
        map.get(key)
            .and_then(Value::as_array)
            .map(Vec::as_slice)
            .unwrap_or_default()
    };
    let words = members("oneOf").iter().chain(members("anyOf")).any(is_word);
    let scalar = |kind: &Value| matches!(kind.as_str(), Some("number" | "integer" | "boolean"));
    let typed = map.get("type").is_some_and(|kind| {
        scalar(kind)
            || kind
                .as_array()
                .is_some_and(|kinds| kinds.iter().any(scalar))
    });
    if typed || words || map.contains_key("enum") {
        let description = map.get("description").cloned();
        let mut either =
            json!({ "anyOf": [inside(map), { "$ref": format!("#/definitions/{VARIABLE}") }] });
        if let (Some(description), Some(object)) = (description, either.as_object_mut()) {
            object.insert("description".into(), description);
        }
        return either;
    }
    Value::Object(inside(map))
}

/// The same for the schemas within one; words that tell variants apart stay as they are.
fn inside(map: Map<String, Value>) -> Map<String, Value> {
    let each = |(key, value): (String, Value)| {
        let value = match (key.as_str(), value) {
            ("properties" | "patternProperties", Value::Object(fields)) => Value::Object(
                fields
                    .into_iter()
                    .map(|(name, field)| (name, with_variables(field)))
                    .collect(),
            ),
            ("items" | "additionalProperties", value) => with_variables(value),
            ("anyOf" | "oneOf" | "allOf", Value::Array(members)) => Value::Array(
                members
                    .into_iter()
                    .map(|member| {
                        if is_word(&member) {
                            member
                        } else {
                            plain(member)
                        }
                    })
                    .collect(),
            ),
            (_, value) => value,
        };
        (key, value)
    };
    map.into_iter().map(each).collect()
}

fn is_word(schema: &Value) -> bool {
    schema.get("const").is_some() || schema.get("enum").is_some()
}
fn plain(schema: Value) -> Value {
    match schema {
        Value::Object(map) => Value::Object(inside(map)),
        other => other,
    }
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
            let mut entries: Vec<(String, Value)> = map
                .into_iter()
                .map(|(key, value)| (key, sorted(value)))
                .collect();
            entries.sort_by(|left, right| left.0.cmp(&right.0));
            Value::Object(entries.into_iter().collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(sorted).collect()),
        plain => plain,
    }
}
