//! `calib simulate reveal`: checks the seal, opens the truths, and marks what a diagnosis said.

use super::super::{emit, emit_json};
use crate::error::{Result, counted};
use crate::proof::{Seal, board, write_scoreboard};
use clap::Args;
use std::path::PathBuf;

/// Open the sealed truths and mark diagnoses.
///
/// Every file of DIR is held against seal.json first; one changed byte and nothing is revealed. VDIR/CASE.json is what
/// `calib diagnose --json` printed for DIR/recordings/CASE. L is the squared displacement that geometry cannot absorb over the
/// noise's variance: from about 15 an effect is detectable, from 50 it should be named.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate reveal blind --verdicts blind/verdicts
  calib simulate reveal blind --verdicts blind/verdicts --out scoreboard.parquet --json > score.json")]
pub(super) struct RevealArguments {
    /// The folder that `conceal` made
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The folder of verdicts, CASE.json each
    #[arg(long, value_name = "VDIR")]
    verdicts: PathBuf,
    /// Writes one row per concealed effect as Parquet (table `scoreboard`)
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

pub(super) fn main(arguments: &RevealArguments) -> Result<()> {
    let sealed = Seal::check(&arguments.folder)?;
    let board = board(&arguments.folder, &sealed, &arguments.verdicts)?;
    if let Some(path) = &arguments.out {
        write_scoreboard(path, &board)?;
    }
    if arguments.json {
        return emit_json(&board.document());
    }
    emit(&format!(
        "the seal holds: {}, all as they were\n{}",
        counted(sealed.len(), "file"),
        board.text()
    ))
}
