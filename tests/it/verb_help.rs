//! The help of every verb: its examples are commands that calib takes.

use crate::answer::root;
use calib::pipeline::{Override, Plan};
use calib::stage::STAGES;
use std::path::PathBuf;
use std::process::Command;

fn help(verb: &[String]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_calib"))
        .args(verb)
        .arg("--help")
        .output()
        .unwrap();
    assert!(output.status.success(), "{verb:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Every verb and verb of a verb, by its words.
fn verbs(above: &[String]) -> Vec<Vec<String>> {
    let text = help(above);
    // The verbs of calib itself stand in groups, before its options.
    let list = match above {
        [] => text.split("\nOptions:\n").next(),
        _ => text
            .split("\nCommands:\n")
            .nth(1)
            .and_then(|tail| tail.split("\n\n").next()),
    };
    let list = list.unwrap_or_default();
    let names = list
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    let mut found = Vec::new();
    for name in names.filter(|name| *name != "help") {
        let verb = [above, &[name.to_string()]].concat();
        found.extend(verbs(&verb));
        found.push(verb);
    }
    found
}

fn shipped() -> Vec<PathBuf> {
    let folder = root("pipelines");
    let mut pipelines: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().join("pipeline.yaml"))
        .collect();
    pipelines.retain(|path| path.is_file());
    pipelines.sort();
    pipelines
}

/// Whether a shipped pipeline takes a setting; its files need not be there.
fn taken(pipelines: &[PathBuf], set: &str) -> bool {
    let set = Override::parse(set).unwrap();
    pipelines.iter().any(
        |path| match Plan::load(path, std::slice::from_ref(&set), STAGES) {
            Ok(_) => true,
            Err(error) => !error
                .to_string()
                .lines()
                .any(|fault| fault.contains("--set") && !fault.contains("no such file")),
        },
    )
}

#[test]
fn every_setting_that_a_help_shows_is_one_of_a_shipped_pipeline() {
    let (pipelines, verbs) = (shipped(), verbs(&[]));
    assert!(
        pipelines.len() > 3 && verbs.len() > 25,
        "{pipelines:?} {verbs:?}"
    );
    let mut shown = Vec::new();
    for verb in &verbs {
        let text = help(verb);
        let words: Vec<&str> = text.split_whitespace().collect();
        let sets = words.windows(2).filter(|pair| {
            pair[0] == "--set" && pair[1].contains('=') && !pair[1].contains("VALUE")
        });
        shown.extend(sets.map(|pair| pair[1].to_string()));
    }
    // What is said of a `--set` without `=` names others.
    let refusal = Override::parse("split").unwrap_err();
    let named = refusal
        .split([' ', ','])
        .filter(|word| word.contains('=') && !word.contains("VALUE"));
    shown.extend(named.map(String::from));
    assert!(shown.len() >= 8, "{shown:?}");
    let refused: Vec<&String> = shown.iter().filter(|set| !taken(&pipelines, set)).collect();
    assert!(refused.is_empty(), "no shipped pipeline takes {refused:?}");
    assert!(
        !taken(&pipelines, "split.every=5"),
        "what is no setting is seen as none"
    );
}

#[test]
fn every_verb_shows_an_example() {
    let without: Vec<Vec<String>> = verbs(&[])
        .into_iter()
        .filter(|verb| !help(verb).contains("\nExamples:\n"))
        .collect();
    assert_eq!(without, Vec::<Vec<String>>::new());
}

#[test]
fn the_help_has_every_verb_in_a_group_within_a_hundred_columns() {
    let text = help(&[]);
    for group in [
        "Calibrate a robot:",
        "Look at what was computed:",
        "Plan a measurement:",
        "Many robots:",
        "Keep the store:",
        "Laboratory:",
    ] {
        assert!(text.lines().any(|line| line == group), "{group} in\n{text}");
    }
    let wide: Vec<&str> = text
        .lines()
        .filter(|line| line.starts_with("  ") && line.len() > 100)
        .collect();
    assert!(wide.is_empty(), "{wide:?}");
}
