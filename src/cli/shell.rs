//! `calib completions` and `calib man`: what a shell and a reader of manuals need, from the same declarations as `--help`.

use super::{Arguments, emit};
use crate::error::{Error, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

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

pub(super) fn completions(arguments: &CompletionsArguments) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(
        arguments.shell,
        &mut Arguments::command(),
        "calib",
        &mut text,
    );
    emit(&String::from_utf8_lossy(&text))
}

pub(super) fn man(arguments: &ManArguments) -> Result<()> {
    let mut whole = Arguments::command();
    whole.build();
    let page = match &arguments.verb {
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
    let title = arguments
        .verb
        .as_ref()
        .map_or_else(|| "calib".into(), |verb| format!("calib-{verb}"));
    let mut text = Vec::new();
    clap_mangen::Man::new(page)
        .title(title)
        .render(&mut text)
        .map_err(|error| Error::Bug(error.to_string()))?;
    emit(&String::from_utf8_lossy(&text))
}
