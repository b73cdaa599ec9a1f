//! `calib simulate`: recordings of a robot whose truth is known.

mod conceal;
mod prove;
mod record;

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
    Reveal(prove::RevealArguments),
    Prove(prove::ProveArguments),
}

impl SimulateArguments {
    pub fn run(&self, command_line: &[OsString]) -> Result<()> {
        match &self.verb {
            SimulateVerb::Record(verb) => verb.run(command_line),
            SimulateVerb::Conceal(verb) => verb.run(),
            SimulateVerb::Reveal(verb) => verb.run(),
            SimulateVerb::Prove(verb) => verb.run(),
        }
    }
}
