//! Writes what the code takes from `*.json`: the list of them for `store::schema`, and for `table` a macro a kind that has its
//! columns as fields of Rust, so that columns, their types and what they mean are stated once.
#![expect(
    clippy::disallowed_methods,
    reason = "a build script is told where to write by the environment"
)]

use serde_json::Value;
use std::fmt::Write as _;
use std::path::PathBuf;

fn main() {
    let folder = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo says it"));
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo says it"));
    println!("cargo::rerun-if-changed={}", folder.display());
    let entries = std::fs::read_dir(&folder).expect("schemas are a folder");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a folder lists its files").path())
        .collect();
    // `NAME.vN.schema.json` is of a file of YAML.
    files.retain(|path| {
        path.extension().is_some_and(|end| end == "json")
            && !path.to_string_lossy().ends_with(".schema.json")
    });
    files.sort();
    let (mut list, mut columns) = (String::from("&[\n"), String::new());
    for path in &files {
        println!("cargo::rerun-if-changed={}", path.display());
        writeln!(list, "include_str!({:?}),", path.display().to_string()).expect("text grows");
        let text = std::fs::read_to_string(path).expect("a schema is text");
        let schema: Value = serde_json::from_str(&text)
            .unwrap_or_else(|fault| panic!("{}: {fault}", path.display()));
        columns.push_str(&fields(&schema));
    }
    std::fs::write(out.join("schemas.rs"), list + "]").expect("OUT_DIR is writable");
    std::fs::write(out.join("columns.rs"), columns).expect("OUT_DIR is writable");
}

/// `macro_rules! KIND`, which hands the fields of a row to `table::rows!` with the names of the two types.
fn fields(schema: &Value) -> String {
    let kind = text(schema, "name");
    let mut out = format!(
        "#[doc(hidden)] #[macro_export] macro_rules! {kind} {{ ($table:ident, $row:ident) => {{ rows! {{ {kind:?}, \
         #[doc = {:?}] pub struct $table of $row {{\n",
        escaped(text(schema, "description"))
    );
    for field in schema["fields"].as_array().into_iter().flatten() {
        let stored = match text(field, "type") {
            "utf8" => "String",
            "int64" => "i64",
            "float64" => "f64",
            "boolean" => "bool",
            other => panic!("{kind}: no Rust type for `{other}`"),
        };
        let may_lack = ["nullable", "optional"]
            .iter()
            .any(|flag| field[flag].as_bool() == Some(true));
        let rust = if may_lack {
            format!("Option<{stored}>")
        } else {
            stored.into()
        };
        // Columns for each joint are of tables that are written by hand: `{j}` is no name of a field.
        let name = text(field, "name").replace(['{', '}'], "");
        writeln!(
            out,
            "#[doc = {:?}] {name}: {rust},",
            escaped(text(field, "description"))
        )
        .expect("text grows");
    }
    out + "} } }; }\n"
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key]
        .as_str()
        .unwrap_or_else(|| panic!("a schema, or a field of it, has no `{key}`"))
}

/// As Markdown, in which brackets are no links.
fn escaped(text: &str) -> String {
    text.replace('[', "\\[")
        .replace(']', "\\]")
        .replace('<', "\\<")
}
