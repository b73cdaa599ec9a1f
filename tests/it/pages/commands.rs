//! The examples of commands that are run: those of the golden cases in `tests/cmd/commands.trycmd`.

use super::blocks::{fenced, root};
use super::reference::leaves;
use calib::cli;
use std::fs;
use std::sync::LazyLock;

/// All cases of `tests/cmd/commands.trycmd`.
pub static GOLDEN: LazyLock<String> = LazyLock::new(|| {
    fs::read_to_string(root().join("tests/cmd/commands.trycmd")).expect("golden cases")
});

/// The cases under a heading, as they stand there; empty where there is no such heading.
fn section(name: &str) -> &'static str {
    let heading = format!("\n## {name}\n");
    GOLDEN.split_once(&heading).map_or("", |(_, tail)| {
        tail.split("\n## ").next().unwrap_or_default().trim()
    })
}

/// The example of a command, with what it answers.
pub fn example(name: &str) -> String {
    let ours = section(name);
    assert!(
        !ours.is_empty(),
        "tests/cmd/commands.trycmd has no example `## {name}`"
    );
    ours.replace("\n\n```", "\n```")
        .replace("\n```console\n", "\n\n```console\n")
        .replace("\n\n\n", "\n\n")
}

#[test]
fn every_command_has_an_example_that_is_run() {
    let missing: Vec<String> = leaves(&cli::command(), &[])
        .into_iter()
        .map(|(words, _)| words.join(" "))
        .filter(|name| {
            let calls = |line: &&str| line.starts_with(&format!("$ calib {name}"));
            !fenced(section(name))
                .any(|block| block.kind == "console" && block.lines.iter().any(calls))
        })
        .collect();
    assert!(
        missing.is_empty(),
        "tests/cmd/commands.trycmd shows no `$ calib ...` for {missing:?}"
    );
}

#[test]
fn the_examples_run_the_pipeline_of_the_repository() {
    for file in ["case/pipeline.yaml", "fleet/pipeline.yaml"] {
        let read =
            |folder: &str| fs::read_to_string(root().join(folder).join(file)).expect("a pipeline");
        assert_eq!(
            read("tests/cmd/commands.in/pipelines"),
            read("pipelines"),
            "copy pipelines/{file} to tests/cmd/commands.in/pipelines"
        );
    }
}
