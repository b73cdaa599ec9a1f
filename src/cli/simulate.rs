//! `calib simulate`: recordings of a robot whose truth is known.

mod conceal;
mod seal;

use crate::error::Result;
use clap::{Args, Subcommand};

/// Make recordings of a simulated robot with hidden effects.
#[derive(Args)]
pub(super) struct SimulateArguments {
    #[command(subcommand)]
    verb: SimulateVerb,
}

#[derive(Subcommand)]
enum SimulateVerb {
    Conceal(conceal::ConcealArguments),
}

pub(super) fn main(arguments: &SimulateArguments) -> Result<()> {
    match &arguments.verb {
        SimulateVerb::Conceal(verb) => conceal::main(verb),
    }
}
