//! Settings of a stage as tables, from their JSON Schema.

use super::blocks::cell;
use serde_json::Value;
use std::collections::BTreeSet;

/// What stands for a variable of the pipeline and is understood everywhere.
const VARIABLE: &str = "calib.variable";
/// Named by the word `file` and needing no table of its own.
const FILE: &str = "RawFile";
/// Words of a setting that are listed.
const MOST_WORDS: usize = 12;

/// The settings of an object, or of each of its variants.
pub fn settings(schema: &Value, definitions: &Value) -> String {
    match schema["properties"].as_object() {
        Some(fields) if fields.is_empty() => "It has no settings.\n".into(),
        Some(_) => table(schema, definitions),
        None => definition(schema, definitions),
    }
}

/// A structure: its fields, its variants, or nothing where its description says all.
fn definition(schema: &Value, definitions: &Value) -> String {
    if schema["properties"]
        .as_object()
        .is_some_and(|fields| !fields.is_empty())
    {
        return table(schema, definitions);
    }
    let variants = variants(schema);
    let words: Vec<&Value> = variants
        .iter()
        .copied()
        .filter(|variant| variant.get("const").is_some())
        .collect();
    let mut text = String::new();
    if !words.is_empty() {
        text.push_str("| value | means |\n|---|---|\n");
        for word in &words {
            text.push_str(&format!(
                "| `{}` | {} |\n",
                plain(&word["const"]),
                about(word)
            ));
        }
    }
    for variant in variants
        .iter()
        .filter(|variant| variant["properties"].is_object())
    {
        let fixed = variant["properties"]
            .as_object()
            .into_iter()
            .flatten()
            .find(|(_, field)| field.get("const").is_some());
        let head = fixed.map_or_else(
            || keys(variant),
            |(key, field)| format!("`{key}: {}`", plain(&field["const"])),
        );
        let description = about(variant);
        let after = if description.is_empty() {
            String::new()
        } else {
            format!(": {description}")
        };
        text.push_str(&format!(
            "\n{head}{after}\n\n{}",
            table(variant, definitions)
        ));
    }
    text.trim_start_matches('\n').to_string()
}

/// The alternatives of a schema, those of alternatives included, without variables.
fn variants(schema: &Value) -> Vec<&Value> {
    let all = ["oneOf", "anyOf"]
        .into_iter()
        .filter_map(|key| schema[key].as_array())
        .flatten();
    let mut out = Vec::new();
    for variant in all.filter(|variant| reference(variant) != Some(VARIABLE)) {
        match variants(variant) {
            inner if inner.is_empty() => out.push(variant),
            inner => out.extend(inner),
        }
    }
    out
}

fn keys(variant: &Value) -> String {
    let names = variant["properties"]
        .as_object()
        .into_iter()
        .flatten()
        .map(|(key, _)| format!("`{key}`"));
    names.collect::<Vec<_>>().join(", ")
}

fn table(schema: &Value, definitions: &Value) -> String {
    let required: BTreeSet<&str> = schema["required"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    let fields: Vec<(&String, &Value)> = schema["properties"]
        .as_object()
        .into_iter()
        .flatten()
        .collect();
    let rows: Vec<String> = fields
        .iter()
        .filter(|(_, field)| field.get("const").is_none())
        .map(|(name, field)| {
            let default = if required.contains(name.as_str()) {
                "required".into()
            } else {
                default(field)
            };
            format!(
                "| `{name}` | {} | {default} | {} |\n",
                kind(field, definitions),
                about(field)
            )
        })
        .collect();
    if rows.is_empty() {
        String::new()
    } else {
        format!(
            "| setting | type | default | meaning |\n|---|---|---|---|\n{}",
            rows.concat()
        )
    }
}

fn about(schema: &Value) -> String {
    schema["description"].as_str().map(cell).unwrap_or_default()
}

/// What a setting is when it is not given.
fn default(field: &Value) -> String {
    let inner = || {
        variants(field)
            .into_iter()
            .find_map(|variant| variant.get("default"))
    };
    match field.get("default").or_else(inner) {
        None | Some(Value::Null) => "-".into(),
        Some(Value::Array(items)) if items.is_empty() => "none".into(),
        Some(Value::Object(fields)) if fields.is_empty() => "none".into(),
        Some(value) => format!("`{}`", cell(&plain(value))),
    }
}

/// A value as YAML has it.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => format!(
            "[{}]",
            items.iter().map(plain).collect::<Vec<_>>().join(", ")
        ),
        Value::Object(fields) => {
            format!(
                "{{{}}}",
                fields
                    .iter()
                    .map(|(key, value)| format!("{key}: {}", plain(value)))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        }
        other => other.to_string(),
    }
}

fn reference(schema: &Value) -> Option<&str> {
    schema["$ref"]
        .as_str()
        .map(|path| path.trim_start_matches("#/definitions/"))
}

/// What may stand there, in words; structures by their names in the JSON Schema.
fn kind(schema: &Value, definitions: &Value) -> String {
    if let Some(name) = reference(schema) {
        let words = variants(&definitions[name]);
        let is_word = |word: &&Value| word.get("const").is_some();
        return if name == FILE {
            "file".into()
        } else if !words.is_empty() && words.len() <= MOST_WORDS && words.iter().all(is_word) {
            let word = |word: &&Value| format!("`{}`", plain(&word["const"]));
            words.iter().map(word).collect::<Vec<_>>().join(", ")
        } else {
            name.into()
        };
    }
    if let Some(word) = schema.get("const") {
        return format!("`{}`", plain(word));
    }
    if let Some([one]) = schema["allOf"].as_array().map(Vec::as_slice) {
        return kind(one, definitions);
    }
    let variants = variants(schema);
    if !variants.is_empty() {
        let mut words: Vec<String> = Vec::new();
        for word in variants
            .iter()
            .filter(|variant| variant["type"] != "null")
            .map(|variant| kind(variant, definitions))
        {
            if !words.contains(&word) {
                words.push(word);
            }
        }
        return words.join(" or ");
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::String(one) => vec![one],
        Value::Array(some) => some
            .iter()
            .filter_map(Value::as_str)
            .filter(|one| *one != "null")
            .collect(),
        _ => Vec::new(),
    };
    types
        .into_iter()
        .map(|one| simple(one, schema, definitions))
        .collect::<Vec<_>>()
        .join(" or ")
}

fn simple(kind_of: &str, schema: &Value, definitions: &Value) -> String {
    match kind_of {
        "string" => "text".into(),
        "boolean" => "`true` or `false`".into(),
        "array" => match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
            (Some(low), Some(high)) if low == high => {
                format!("{low} {}", several(&kind(&schema["items"], definitions)))
            }
            _ => format!("list of {}", several(&kind(&schema["items"], definitions))),
        },
        "object" if schema["additionalProperties"].is_object() => {
            format!(
                "name: {}",
                kind(&schema["additionalProperties"], definitions)
            )
        }
        "object" => keys(schema),
        other => other.into(),
    }
}

/// More than one of a kind.
fn several(kind: &str) -> String {
    if ["number", "integer", "text", "file"].contains(&kind) {
        format!("{kind}s")
    } else {
        kind.into()
    }
}
