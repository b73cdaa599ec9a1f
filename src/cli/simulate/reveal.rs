//! `calib simulate reveal`: checks the seal, opens the truths, and marks what a diagnosis said.

use super::super::{emit, emit_json};
use super::seal::{SEALED, Seal};
use crate::error::{Error, Result, counted};
use crate::raw;
use crate::table::{Scoreboard, ScoreboardRow, Table};
use crate::twin::reveal::board::Board;
use crate::twin::reveal::mark::{Case, mark};
use crate::twin::reveal::paper::{Answer, Truth};
use clap::Args;
use parquet::arrow::ArrowWriter;
use std::path::{Path, PathBuf};

/// Open the sealed truths and mark diagnoses.
///
/// Every file of DIR is held against seal.json first; one changed byte and nothing is revealed. VDIR/CASE.json is what
/// `calib diagnose --json` printed for DIR/recordings/CASE. L is the squared displacement that geometry cannot absorb over the
/// noise's variance: about 15 can be seen at all, 50 should be named.
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
        write(path, &board)?;
    }
    if arguments.json {
        return emit_json(&board.document());
    }
    emit(&format!("the seal holds: {}, all as they were\n{}", counted(sealed.len(), "file"), board.text()))
}

/// All sealed cases of the set, marked; `files` are the paths that the seal holds.
pub(super) fn board(folder: &Path, files: &[String], verdicts: &Path) -> Result<Board> {
    let mut board = Board::default();
    for name in files.iter().filter(|name| Path::new(name).starts_with(SEALED)) {
        let path = folder.join(name);
        let truth: Truth = read(&path).map_err(|why| Error::data(path.display().to_string(), why))?;
        match read::<Answer>(&verdicts.join(path.file_name().unwrap_or_default())) {
            Ok(answer) => board.cases.push(mark(&truth, &answer)),
            Err(why) => board.missing.push((truth.case, why)),
        }
    }
    Ok(board)
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, String> {
    let text = raw::text(path).map_err(|error| error.to_string())?;
    serde_json::from_str(&text).map_err(|error| error.to_string())
}

fn rows(case: &Case) -> Vec<ScoreboardRow> {
    let row = |number: usize, effect: Option<String>| ScoreboardRow {
        case: case.name.clone(),
        number: number as i64,
        content: case.content.clone(),
        robot: case.robot.clone(),
        points: case.points as i64,
        effect,
        place: None,
        form: None,
        visibility: None,
        outcome: None,
        said: case.strays.first().cloned(),
        strays: case.strays.len() as i64,
        verdict: case.verdict.clone(),
        heldout_before_mm: case.held_out.map(|held_out| held_out.before),
        heldout_after_mm: case.held_out.map(|held_out| held_out.after),
        heldout_bound_mm: case.held_out.map(|held_out| held_out.bound),
    };
    if case.causes.is_empty() {
        return vec![row(0, None)];
    }
    let causes = case.causes.iter().enumerate().map(|(number, cause)| ScoreboardRow {
        place: Some(cause.place.clone()),
        form: Some(cause.form.clone()),
        visibility: Some(cause.strength),
        outcome: Some(cause.outcome.name().into()),
        ..row(number, Some(cause.effect.clone()))
    });
    causes.collect()
}

fn write(path: &Path, board: &Board) -> Result<()> {
    let frame = Scoreboard(board.cases.iter().flat_map(rows).collect()).to_frame()?;
    let fault = |error: String| Error::store(path.display().to_string(), format!("cannot be written: {error}"));
    let file = std::fs::File::create(path).map_err(|error| fault(error.to_string()))?;
    let mut writer = ArrowWriter::try_new(file, frame.batch().schema(), None).map_err(|error| fault(error.to_string()))?;
    writer.write(frame.batch()).map_err(|error| fault(error.to_string()))?;
    writer.close().map_err(|error| fault(error.to_string()))?;
    Ok(())
}
