//! The help of calib itself: its verbs in groups, by what one is about to do.
//!
//! `calib completions` and `calib man`: what a shell and a reader of manuals need, from the same declarations as `--help`.

use super::{Arguments, emit_bytes};
use crate::error::{Error, Result};
use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;

/// What one is about to do, and the verbs for it.
const GROUPS: [(&str, &str); 7] = [
    (
        "Calibrate a robot",
        "init check run diagnose compensate serve-model verify-robot export check-export",
    ),
    (
        "Look at what was computed",
        "show log diff explain query lineage schema",
    ),
    ("Plan a measurement", "poses excite"),
    ("Many robots", "fleet"),
    ("Keep the store", "tag verify gc"),
    ("Laboratory", "simulate effects robots"),
    ("Shell", "completions man"),
];

/// The command with its verbs in groups, each with the first clause of what it does.
pub(super) fn grouped(command: Command) -> Command {
    let width = command
        .get_subcommands()
        .map(|verb| verb.get_name().len())
        .max()
        .unwrap_or(0);
    let line = |verb: &str| {
        let about = command
            .find_subcommand(verb)
            .and_then(Command::get_about)
            .map(ToString::to_string)
            .unwrap_or_default();
        let clause = about.split(": ").next().unwrap_or_default();
        format!("  {verb:width$}  {clause}\n")
    };
    let header = clap::builder::Styles::styled();
    let header = header.get_header();
    let group = |(what, verbs): &(&str, &str)| {
        format!(
            "{header}{what}:{header:#}\n{}\n",
            verbs.split(' ').map(line).collect::<String>()
        )
    };
    let groups: String = GROUPS.iter().map(group).collect();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}`calib VERB --help` says more of a verb.\n\n\
         {header}Options:{header:#}\n{{options}}{{after-help}}"
    );
    command.help_template(template)
}

/// Print completions for a shell.
#[derive(Args)]
#[command(after_help = "Examples:
  calib completions bash > ~/.local/share/bash-completion/completions/calib
  calib completions zsh > ~/.zfunc/_calib
  calib completions fish > ~/.config/fish/completions/calib.fish")]
pub(super) struct CompletionsArguments {
    /// The shell
    shell: Shell,
}

/// Print the manual page, of calib or of one of its verbs.
#[derive(Args)]
#[command(after_help = "Examples:
  calib man | man -l -
  calib man compensate > calib-compensate.1")]
pub(super) struct ManArguments {
    /// The verb [default: calib itself]
    verb: Option<String>,
}

impl CompletionsArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "calib", &mut text);
        emit_bytes(&text)
    }
}

impl ManArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let mut whole = Arguments::command();
        whole.build();
        let page = match &self.verb {
            None => whole,
            Some(verb) => {
                let verbs: Vec<String> = whole
                    .get_subcommands()
                    .map(|verb| verb.get_name().to_string())
                    .collect();
                let found = whole
                    .get_subcommands()
                    .find(|known| known.get_name() == verb);
                let unknown = || {
                    Error::spec(
                        "man",
                        format!("no command `{verb}`; allowed: {}", verbs.join(", ")),
                    )
                };
                found.ok_or_else(unknown)?.clone()
            }
        };
        let title = self
            .verb
            .as_ref()
            .map_or_else(|| "calib".into(), |verb| format!("calib-{verb}"));
        let mut text = Vec::new();
        clap_mangen::Man::new(page)
            .title(title)
            .render(&mut text)
            .map_err(|error| Error::Bug(error.to_string()))?;
        emit_bytes(&text)
    }
}

#[cfg(test)]
mod tests {
    use super::GROUPS;
    use clap::CommandFactory;

    #[test]
    fn every_verb_stands_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, verbs)| verbs.split(' '))
            .collect();
        grouped.sort_unstable();
        let command = crate::cli::Arguments::command();
        let mut verbs: Vec<&str> = command
            .get_subcommands()
            .map(clap::Command::get_name)
            .collect();
        verbs.sort_unstable();
        assert_eq!(grouped, verbs);
    }
}
