//! The map in `src/lib.rs` is true: every layer uses what its row of the table allows, and nothing else.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::source::{Source, sources, uses};

/// What every layer may use without saying so.
const FREE: [&str; 3] = ["error", "units", "statistics"];
const NUMERICS: [&str; 10] = [
    "description",
    "spatial",
    "robot",
    "effect",
    "observation",
    "estimate",
    "diagnose",
    "dynamics",
    "engine",
    "drives",
];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Layer -> what it may use, from the rows ``| [`layer`] | holds | may use |``, a private one without brackets. A use is a module or `module::file`.
fn table() -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(source().join("lib.rs")).unwrap();
    let rows = text
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "))
        .filter(|row| row.starts_with(['[', '`']));
    let mut table = BTreeMap::new();
    for row in rows {
        let cells: Vec<&str> = row.trim_end_matches(" |").split(" | ").collect();
        let [names, _, uses] = cells[..] else {
            continue;
        };
        let mut allowed = BTreeSet::new();
        for word in uses.split([',', ';']).map(str::trim) {
            match word {
                "-" => (),
                "the numerics" | "numerics" => allowed.extend(NUMERICS.map(String::from)),
                "the robot's description only" => allowed.extend(["description".to_string()]),
                "robot" => allowed.extend(["robot", "description"].map(String::from)),
                "all" => allowed.extend(["*".to_string()]),
                other => allowed.extend([other.to_string()]),
            }
        }
        for name in names
            .split(", ")
            .map(|name| name.trim_matches(['[', ']', '`']))
        {
            table.insert(name.to_string(), allowed.clone());
        }
    }
    table
}

#[test]
fn every_layer_is_a_row_of_the_map_and_every_row_a_layer() {
    let text = ["lib.rs", "foundation/lib.rs", "numerics/lib.rs"]
        .map(|file| fs::read_to_string(source().join(file)).unwrap())
        .concat();
    let declared: BTreeSet<String> = text
        .lines()
        .filter_map(|line| {
            line.strip_prefix("pub mod ")
                .or_else(|| line.strip_prefix("pub(crate) mod "))?
                .strip_suffix(';')
                .map(String::from)
        })
        .chain(["diagnose", "drives", "dynamics", "engine", "twin"].map(String::from))
        .collect();
    assert_eq!(declared, table().into_keys().collect::<BTreeSet<_>>());
}

/// What a path from the root of the crate leads to: its layer, and `layer::item`.
fn leads_to(path: &[String]) -> (&str, String) {
    let part = |at: usize| path.get(at).map_or("", String::as_str);
    (part(0), format!("{}::{}", part(0), part(1)))
}

/// Uses of the sources that the table does not allow.
fn breaches(sources: &[Source], table: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        let Some((layer, allowed)) = source
            .module
            .first()
            .and_then(|layer| table.get_key_value(layer))
        else {
            continue;
        };
        for one in &source.uses {
            let (module, item) = leads_to(&one.path);
            let free = FREE.contains(&module) || module == layer;
            let known = table.contains_key(module);
            if known
                && !free
                && !["*", module, &item]
                    .iter()
                    .any(|name| allowed.contains(*name))
            {
                faults.push(format!("{}:{}: {layer} uses {item}", source.file, one.line));
            }
        }
    }
    faults
}

#[test]
fn layers_use_only_what_the_map_allows() {
    let faults = breaches(&sources(), &table());
    assert!(
        faults.is_empty(),
        "not in the map of src/lib.rs:\n{}",
        faults.join("\n")
    );
}

#[test]
fn a_breach_is_found_in_a_group_behind_unit_tests_and_inside_an_expression() {
    let text = "#[cfg(test)]\nmod tests;\nuse crate::{error::Result, cli::{self, run::main}};\n\
                fn f() { crate::pipeline::run(); super::super::stage::Plan; }\n";
    let module = vec!["store".to_string(), "key".to_string()];
    let source = Source {
        file: "store/key.rs".into(),
        uses: uses(text, &module, &[]),
        module,
    };
    assert_eq!(
        breaches(&[source], &table()),
        [
            "store/key.rs:3: store uses cli::",
            "store/key.rs:3: store uses cli::run",
            "store/key.rs:4: store uses pipeline::run",
            "store/key.rs:4: store uses stage::Plan",
        ]
    );
}

#[test]
fn stages_do_not_use_each_other() {
    let names: Vec<String> = fs::read_dir(source().join("stage"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        // What several stages share is no stage.
        .filter(|path| {
            path.is_file() && fs::read_to_string(path).unwrap().contains("impl Stage for")
        })
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let mut faults = Vec::new();
    for source in sources() {
        let ["stage", stage, ..] = source.module.iter().map(String::as_str).collect::<Vec<_>>()[..]
        else {
            continue;
        };
        for one in &source.uses {
            let (module, item) = leads_to(&one.path);
            let other = item.trim_start_matches("stage::");
            if module == "stage" && other != stage && names.iter().any(|name| name == other) {
                faults.push(format!("{}:{}: uses {item}", source.file, one.line));
            }
        }
    }
    assert!(
        faults.is_empty(),
        "stages know tables, not each other:\n{}",
        faults.join("\n")
    );
}
