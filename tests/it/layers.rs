//! The map in `src/lib.rs` is true: every layer uses what its row of the table allows, and nothing else.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What every layer may use without saying so.
const FREE: [&str; 2] = ["error", "units"];
const NUMERICS: [&str; 5] = ["spatial", "robot", "effect", "estimate", "diagnose"];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Layer -> what it may use, from the rows ``| [`layer`] | holds | may use |``. A use is a module or `module::file`.
fn table() -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(source().join("lib.rs")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("//! | [`"));
    let mut table = BTreeMap::new();
    for row in rows {
        let row = format!("[`{row}");
        let cells: Vec<&str> = row.trim_end_matches(" |").split(" | ").collect();
        let [names, _, uses] = cells[..] else { continue };
        let mut allowed = BTreeSet::new();
        for word in uses.split([',', ';']).map(str::trim) {
            match word {
                "-" => (),
                "the numerics" | "numerics" => allowed.extend(NUMERICS.map(String::from)),
                "the robot's description only" => allowed.extend(["robot::description".to_string()]),
                "all" => allowed.extend(["*".to_string()]),
                other => allowed.extend([other.to_string()]),
            }
        }
        for name in names.split(", ").map(|name| name.trim_matches(['[', ']', '`'])) {
            table.insert(name.to_string(), allowed.clone());
        }
    }
    table
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// `crate::a::b` -> (`a`, `a::b`), outside comments and unit tests.
fn uses(text: &str) -> Vec<(usize, String, String)> {
    let body = text.lines().take_while(|line| line.trim() != "#[cfg(test)]").enumerate();
    let code = body.filter(|(_, line)| !line.trim_start().starts_with("//"));
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    code.flat_map(|(number, line)| {
        line.split("crate::").skip(1).map(move |rest| {
            let first = word(rest);
            let second = rest.strip_prefix(&format!("{first}::")).map(word).unwrap_or_default();
            (number + 1, first.clone(), format!("{first}::{second}"))
        })
    })
    .collect()
}

#[test]
fn every_layer_is_a_row_of_the_map_and_every_row_a_layer() {
    let text = fs::read_to_string(source().join("lib.rs")).unwrap();
    let declared: BTreeSet<String> =
        text.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';').map(String::from)).collect();
    assert_eq!(declared, table().into_keys().collect::<BTreeSet<_>>());
}

#[test]
fn layers_use_only_what_the_map_allows() {
    let table = table();
    let mut faults = Vec::new();
    for path in files(&source()) {
        let relative = path.strip_prefix(source()).unwrap();
        let layer = relative.components().next().unwrap().as_os_str().to_string_lossy().trim_end_matches(".rs").to_string();
        let Some(allowed) = table.get(&layer) else { continue };
        for (line, module, item) in uses(&fs::read_to_string(&path).unwrap()) {
            let free = FREE.contains(&module.as_str()) || module == layer;
            let known = table.contains_key(&module);
            if known && !free && !["*", &module, &item].iter().any(|name| allowed.contains(*name)) {
                faults.push(format!("{}:{line}: {layer} uses {item}", relative.display()));
            }
        }
    }
    assert!(faults.is_empty(), "not in the map of src/lib.rs:\n{}", faults.join("\n"));
}

#[test]
fn stages_do_not_use_each_other() {
    let names: Vec<String> = fs::read_dir(source().join("stage"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        // What several stages share is no stage.
        .filter(|path| path.is_file() && fs::read_to_string(path).unwrap().contains("impl Stage for"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let mut faults = Vec::new();
    for path in files(&source().join("stage")) {
        let relative = path.strip_prefix(source().join("stage")).unwrap();
        let own = relative.components().next().unwrap().as_os_str().to_string_lossy().trim_end_matches(".rs").to_string();
        for (line, module, item) in uses(&fs::read_to_string(&path).unwrap()) {
            let other = item.trim_start_matches("stage::");
            if module == "stage" && own != "mod" && other != own && names.iter().any(|name| name == other) {
                faults.push(format!("stage/{}:{line}: uses {item}", relative.display()));
            }
        }
    }
    assert!(faults.is_empty(), "stages know tables, not each other:\n{}", faults.join("\n"));
}
