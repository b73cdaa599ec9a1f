//! `calib simulate`: recordings of a robot whose truth is known.

mod conceal;
mod prove;
mod reveal;
mod seal;

use crate::error::Result;
use clap::{Args, Subcommand};

/// Make recordings of a simulated robot with hidden effects, and mark what a diagnosis made of them.
#[derive(Args)]
pub(super) struct SimulateArguments {
    #[command(subcommand)]
    verb: SimulateVerb,
}

#[derive(Subcommand)]
enum SimulateVerb {
    Conceal(conceal::ConcealArguments),
    Reveal(reveal::RevealArguments),
    Prove(prove::ProveArguments),
}

pub(super) fn main(arguments: &SimulateArguments) -> Result<()> {
    match &arguments.verb {
        SimulateVerb::Conceal(verb) => conceal::main(verb),
        SimulateVerb::Reveal(verb) => reveal::main(verb),
        SimulateVerb::Prove(verb) => prove::main(verb),
    }
}
