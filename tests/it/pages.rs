//! The pages: their generated parts are those of the code, their links lead somewhere, their commands are understood.
//!
//! `CALIB_UPDATE=1 cargo test --test it pages` writes the generated parts anew; look at the difference before you keep it.

mod blocks;
mod causes;
mod commands;
mod links;
mod reference;
mod seat_compliance;
mod settings;
mod stages;
mod tables;
mod tutorials;
mod typed;

use blocks::root;
use std::collections::BTreeSet;
use std::fs;

/// A generated part: the page that holds it, its name in the page, and what it says.
struct Part {
    page: &'static str,
    name: &'static str,
    text: String,
}

fn parts() -> Vec<Part> {
    let part = |page, name, text| Part { page, name, text };
    vec![
        part("pipelines/README.md", "stages", stages::text()),
        part("schemas/README.md", "tables", tables::text()),
        part("src/cli/README.md", "commands", reference::text()),
        part(
            "src/numerics/effect/README.md",
            "example diagnose",
            commands::example("diagnose"),
        ),
        part("src/numerics/effect/README.md", "causes", causes::text()),
        part("src/numerics/effect/README.md", "walk", causes::walk()),
    ]
}

#[test]
fn generated_parts_of_the_pages_are_those_of_the_code() {
    let update = std::env::var_os("CALIB_UPDATE").is_some();
    let mut stale = Vec::new();
    for Part { page, name, text } in parts() {
        let path = root().join(page);
        let old = fs::read_to_string(&path).expect("a page");
        let new = blocks::replaced(&old, name, &text)
            .unwrap_or_else(|| panic!("{page}: no block `<!-- generated: {name} -->`"));
        if new != old {
            stale.push(format!("{page}: {name}"));
            if update {
                fs::write(&path, new).expect("a page that can be written");
            }
        }
    }
    assert!(
        update || stale.is_empty(),
        "write them anew with CALIB_UPDATE=1 cargo test --test it pages: {stale:?}"
    );
}

#[test]
fn every_generated_block_of_a_page_is_generated() {
    let known: BTreeSet<(String, String)> = parts()
        .into_iter()
        .map(|part| (part.page.into(), part.name.into()))
        .collect();
    let mut found = BTreeSet::new();
    for (page, text) in blocks::pages() {
        for line in text
            .lines()
            .filter_map(|line| line.strip_prefix("<!-- generated: ")?.strip_suffix(" -->"))
        {
            assert!(
                found.insert((page.clone(), line.to_string())),
                "{page}: two blocks `{line}`"
            );
        }
    }
    assert_eq!(found, known);
}

#[test]
fn the_front_page_is_one_screen_of_reading() {
    let text = fs::read_to_string(root().join("README.md")).expect("a README");
    let lines = text.lines().count();
    assert!(
        lines <= 180,
        "README.md has {lines} lines; what is more than a door belongs into a page of its folder"
    );
}

#[test]
fn what_the_front_page_quotes_stands_in_full_elsewhere() {
    let text = fs::read_to_string(root().join("README.md")).expect("a README");
    let evidence = fs::read_to_string(root().join("pipelines/proof/README.md")).expect("a page");
    let whole: BTreeSet<&str> = evidence
        .lines()
        .chain(commands::GOLDEN.lines())
        .map(str::trim_end)
        .collect();
    let quoted: Vec<&str> = blocks::fenced(&text)
        .filter(|block| block.kind == "text")
        .flat_map(|block| block.lines)
        .collect();
    assert!(!quoted.is_empty());
    let missing: Vec<&str> = quoted
        .into_iter()
        .filter(|line| !whole.contains(line.trim_end()))
        .collect();
    assert!(
        missing.is_empty(),
        "neither in pipelines/proof/README.md nor in tests/cmd/commands.trycmd:\n{}",
        missing.join("\n")
    );
}
