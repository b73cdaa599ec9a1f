//! Every table with its columns, from the schemas.

use super::blocks::cell;
use calib::store::schema::{ColumnType, FieldSchema, all};

pub fn text() -> String {
    let mut text = String::from("| table | version | holds |\n|---|---|---|\n");
    for table in all() {
        text.push_str(&format!(
            "| [{0}](#{0}) | {1} | {2} |\n",
            table.name,
            table.version,
            cell(&table.description)
        ));
    }
    text.push_str("\n`{j}` in a column's name stands for a joint, from 1. \"or null\": where nothing is known. \"may be missing\": tables without it are read too.\n");
    for table in all() {
        text.push_str(&format!(
            "\n### {}\n\n{} Key: `{}`.\n\n",
            table.name,
            table.description,
            table.primary_key.join("`, `")
        ));
        text.push_str("| column | type | unit | meaning |\n|---|---|---|---|\n");
        for field in &table.fields {
            let unit = field
                .unit
                .as_deref()
                .filter(|unit| *unit != "1")
                .unwrap_or("");
            text.push_str(&format!(
                "| `{}` | {} | {unit} | {} |\n",
                field.name,
                kind(field),
                cell(&field.description)
            ));
        }
    }
    text
}

fn kind(field: &FieldSchema) -> String {
    let kind = match field.column_type {
        ColumnType::Utf8 => "text",
        ColumnType::Int64 => "integer",
        ColumnType::Float64 => "number",
        ColumnType::Boolean => "true or false",
    };
    let null = if field.nullable { " or null" } else { "" };
    let missing = if field.optional {
        ", may be missing"
    } else {
        ""
    };
    format!("{kind}{null}{missing}")
}
