//! `calib effects`: the library of effects, in words.

use super::{emit, emit_json};
use crate::effect::{CAUSES, Cause, cause};
use crate::error::{Error, Result};
use crate::summary::effects_json;
use clap::Args;

/// List the effects that calib knows: formula, usual size, what each is confounded with, and what a recording needs to show it.
#[derive(Args)]
#[command(after_help = "Examples:
  calib effects
  calib effects backlash
  calib effects --json")]
pub(super) struct EffectsArguments {
    /// One effect by its name
    #[arg(value_name = "EFFECT")]
    name: Option<String>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

pub(super) fn main(arguments: &EffectsArguments) -> Result<()> {
    let chosen: Vec<&Cause> = match &arguments.name {
        None => CAUSES.to_vec(),
        Some(name) => vec![cause(name).ok_or_else(|| unknown(name))?],
    };
    if arguments.json {
        return emit_json(&effects_json(&chosen));
    }
    let text: Vec<String> = chosen.iter().map(|about| entry(about)).collect();
    emit(&text.join("\n"))
}

fn entry(about: &Cause) -> String {
    let measure = about.measure.map_or_else(String::new, |measure| {
        format!("  measure     {}\n", measure.advice)
    });
    format!(
        "{} ({})\n  formula     {}\n  usual size  {}\n  confounded  {}\n  needs       {}\n{measure}",
        about.name, about.place, about.formula, about.size, about.confounded, about.needs
    )
}

fn unknown(name: &str) -> Error {
    let names: Vec<&str> = CAUSES.iter().map(|cause| cause.name()).collect();
    Error::spec(
        "EFFECT",
        format!("no effect `{name}`; allowed: {}", names.join(", ")),
    )
}
