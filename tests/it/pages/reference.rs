//! Every command, from clap.

use calib::cli;
use clap::Command;

/// Every command that does something, with the words that lead to it.
pub fn leaves(command: &Command, words: &[String]) -> Vec<(Vec<String>, Command)> {
    let ours: Vec<&Command> = command
        .get_subcommands()
        .filter(|verb| verb.get_name() != "help" && !verb.is_hide_set())
        .collect();
    if ours.is_empty() {
        return vec![(words.to_vec(), command.clone())];
    }
    ours.into_iter()
        .flat_map(|verb| leaves(verb, &[words, &[verb.get_name().to_string()]].concat()))
        .collect()
}

fn built() -> Command {
    let mut command = cli::command();
    command.build();
    command
}

pub fn text() -> String {
    let mut text = String::from("| command | what it does |\n|---|---|\n");
    for (words, command) in leaves(&built(), &[]) {
        let about = command
            .get_about()
            .map(ToString::to_string)
            .unwrap_or_default();
        text.push_str(&format!(
            "| `calib {}` | {} |\n",
            words.join(" "),
            about.replace('|', "\\|")
        ));
    }
    text
}
