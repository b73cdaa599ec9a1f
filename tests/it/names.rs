//! A name of a type means one thing: what is public, of the crate or of a room, is defined once outside the twin, which shares
//! nothing with the rest.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::source::files;

/// Public types that are defined more than once although their names are alike, and why; none.
const ALLOWED: [(&str, &str); 0] = [];

/// A definition: the name, and whether other files may use it.
fn definition(line: &str) -> Option<(&str, bool)> {
    let code = line.trim_start();
    let open = code.strip_prefix("pub").and_then(|rest| match rest.strip_prefix('(') {
        Some(rest) => rest.split_once(") ").map(|(_, rest)| rest),
        None => rest.strip_prefix(' '),
    });
    let (word, rest) = open.unwrap_or(code).split_once(' ')?;
    // Indented and private: a type of a trait's implementation.
    let owned = word == "type" && open.is_none() && code.len() < line.len();
    let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    (["struct", "enum", "union", "trait", "type"].contains(&word) && !owned && !name.is_empty()).then_some((name, open.is_some()))
}

/// Name -> where it is defined, of names that are defined more than once and of which one is public.
fn repeated(texts: &[(String, String)]) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, (bool, Vec<String>)> = BTreeMap::new();
    for (file, text) in texts {
        for (number, (name, open)) in text.lines().enumerate().filter_map(|(index, line)| Some((index + 1, definition(line)?))) {
            let entry = found.entry(name.into()).or_default();
            entry.0 |= open;
            entry.1.push(format!("src/{file}:{number}"));
        }
    }
    found.into_iter().filter(|(_, (open, places))| *open && places.len() > 1).map(|(name, (_, places))| (name, places)).collect()
}

#[test]
fn a_public_type_name_is_defined_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let name = |path: &Path| path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
    let texts: Vec<(String, String)> = files(&root)
        .into_iter()
        .map(|path| (name(&path), fs::read_to_string(&path).unwrap()))
        .filter(|(file, _)| !file.starts_with("twin/"))
        .collect();
    assert!(texts.len() > 300, "only {} files were found", texts.len());
    let repeated = repeated(&texts);
    let faults: Vec<String> = repeated
        .iter()
        .filter(|(name, _)| ALLOWED.iter().all(|(allowed, _)| allowed != name))
        .map(|(name, places)| format!("{name}: {}", places.join(", ")))
        .collect();
    assert!(faults.is_empty(), "give each concept a name of its own:\n{}", faults.join("\n"));
    let gone: Vec<&str> = ALLOWED.iter().map(|(name, _)| *name).filter(|name| !repeated.contains_key(*name)).collect();
    assert!(gone.is_empty(), "no longer repeated, take them off the list: {gone:?}");
}

#[test]
fn a_repeated_name_is_found_behind_every_kind_of_definition() {
    let texts = [
        (
            "one.rs",
            "pub struct Row {\n    pub kind: Kind,\n}\nstruct Own;\n    pub struct Rows of Row {\nimpl Stage {\n    type Reads = ();\n",
        ),
        ("two.rs", "pub(super) enum Row<'a> {}\nstruct Own;\npub(in crate::a) trait Rows: Sized {}\npub type Reads = ();\n"),
        ("three.rs", "type Row = u8;\npub fn structure() {}\n// pub struct Rows\n"),
    ];
    let found = repeated(&texts.map(|(file, text)| (file.into(), text.into())));
    let expected =
        [("Row", vec!["src/one.rs:1", "src/two.rs:1", "src/three.rs:1"]), ("Rows", vec!["src/one.rs:5", "src/two.rs:3"])];
    assert_eq!(found, expected.map(|(name, places)| (name.into(), places.into_iter().map(String::from).collect())).into());
}
