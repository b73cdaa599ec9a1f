//! Causes are named in one place: what one says of another, and what a diagnosis says of any, goes by a constant or by a relation.

use crate::source::files;
use calib::effect::CAUSES;
use std::fs;
use std::path::Path;

/// Files of a room with their text up to their tests.
fn code(room: &str) -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/numerics");
    let read = |path: &std::path::PathBuf| {
        let text = fs::read_to_string(path).unwrap();
        let name = path
            .strip_prefix(&root)
            .unwrap()
            .to_string_lossy()
            .replace('\\', "/");
        (
            name,
            text.split("#[cfg(test)]")
                .next()
                .unwrap_or_default()
                .to_string(),
        )
    };
    files(&root.join(room)).iter().map(read).collect()
}

/// Lines of a text that name a cause by a string, what describes a cause to people apart.
fn named(text: &str) -> Vec<&str> {
    let described = ["name: ", "place: ", "confounded: ", "//"];
    // `anchor` is the name of a place, too.
    let names = || {
        CAUSES
            .iter()
            .map(|cause| cause.name())
            .filter(|name| *name != "anchor")
    };
    let is_named = |line: &&str| {
        let code = line.trim_start();
        !described.iter().any(|own| code.starts_with(own))
            && names().any(|name| code.contains(&format!("\"{name}\"")))
    };
    text.lines().filter(is_named).collect()
}

#[test]
fn no_diagnosis_and_no_cause_names_a_cause_by_a_string() {
    let all = ["diagnose", "effect"]
        .into_iter()
        .flat_map(code)
        .filter(|(file, _)| file != "effect/names.rs");
    let found: Vec<String> = all
        .flat_map(|(file, text)| {
            named(&text)
                .into_iter()
                .map(|line| format!("{file}: {}", line.trim()))
                .collect::<Vec<_>>()
        })
        .collect();
    assert_eq!(
        found,
        Vec::<String>::new(),
        "the names of causes are constants of effect/names.rs"
    );
}

#[test]
fn a_string_that_names_a_cause_is_seen() {
    assert_eq!(
        named(
            "let a = \"backlash\";\n    name: \"backlash\",\n// \"backlash\"\nlet b = \"backlashes\";"
        ),
        ["let a = \"backlash\";"]
    );
}
