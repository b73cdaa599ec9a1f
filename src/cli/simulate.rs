//! `calib simulate`: recordings of a robot whose truth is known.

mod conceal;
mod prove;
mod record;
mod reveal;

use crate::error::Result;
use clap::{Args, Subcommand};
use std::ffi::OsString;

/// Make recordings of a simulated robot: with stated or hidden effects; and mark what a diagnosis made of them.
#[derive(Args)]
pub(super) struct SimulateArguments {
    #[command(subcommand)]
    verb: SimulateVerb,
}

#[derive(Subcommand)]
enum SimulateVerb {
    Record(record::RecordArguments),
    Conceal(conceal::ConcealArguments),
    Reveal(reveal::RevealArguments),
    Prove(prove::ProveArguments),
}

pub(super) fn main(arguments: &SimulateArguments, command_line: &[OsString]) -> Result<()> {
    match &arguments.verb {
        SimulateVerb::Record(verb) => record::main(verb, command_line),
        SimulateVerb::Conceal(verb) => conceal::main(verb),
        SimulateVerb::Reveal(verb) => reveal::main(verb),
        SimulateVerb::Prove(verb) => prove::main(verb),
    }
}
