//! Every command with its options, from clap, and an example with what it answers, from the golden cases.

use super::commands::example;
use calib::cli;
use clap::Command;

/// Columns of the help in a page.
const WIDTH: usize = 118;

/// Every command that does something, with the words that lead to it.
pub fn leaves(command: &Command, words: &[String]) -> Vec<(Vec<String>, Command)> {
    let own: Vec<&Command> = command
        .get_subcommands()
        .filter(|verb| verb.get_name() != "help" && !verb.is_hide_set())
        .collect();
    if own.is_empty() {
        return vec![(words.to_vec(), command.clone())];
    }
    own.into_iter()
        .flat_map(|verb| leaves(verb, &[words, &[verb.get_name().to_string()]].concat()))
        .collect()
}

fn built() -> Command {
    let mut command = cli::command().term_width(WIDTH);
    command.build();
    command
}

pub fn text() -> String {
    let all = leaves(&built(), &[]);
    let mut text = String::from("| command | what it does |\n|---|---|\n");
    for (words, command) in &all {
        let about = command
            .get_about()
            .map(ToString::to_string)
            .unwrap_or_default();
        text.push_str(&format!(
            "| [`calib {}`](#calib-{}) | {} |\n",
            words.join(" "),
            words.join("-"),
            about.replace('|', "\\|")
        ));
    }
    text.push_str(
        "\nIn what an example answers, `[..]` and `...` stand for what differs from run to run, or is left out here.\n",
    );
    for (words, mut command) in all {
        let name = words.join(" ");
        let help = command.render_long_help().to_string();
        let help: Vec<&str> = help.lines().map(str::trim_end).collect();
        text.push_str(&format!(
            "\n### calib {name}\n\n{}\n\n```text\n{}\n```\n",
            example(&name),
            squeezed(&help)
        ));
    }
    text
}

/// Without blank lines between options.
fn squeezed(lines: &[&str]) -> String {
    let indented = |line: &str| line.starts_with("  ");
    let mut out: Vec<&str> = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let between = line.is_empty()
            && out.last().is_some_and(|last| indented(last))
            && lines
                .get(at + 1)
                .is_some_and(|next| indented(next) || next.is_empty());
        if !between {
            out.push(line);
        }
    }
    out.join("\n").trim().to_string()
}
