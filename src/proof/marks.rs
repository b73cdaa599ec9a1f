//! Diagnoses held against the sealed truths: the scoreboard, and its table.

use super::set::SEALED;
use crate::error::{Error, Result};
use crate::raw;
use crate::table::{Scoreboard, ScoreboardRow, Table};
use crate::twin::reveal::board::Board;
use crate::twin::reveal::mark::{Case, Marked, NAMELESS, left_out, mark};
use crate::twin::reveal::paper::{Answer, Truth};
use parquet::arrow::ArrowWriter;
use std::fmt::Display;
use std::path::Path;

/// Folder, within that of the verdicts, of diagnoses without the causes of their recordings.
pub const LEFT_OUT: &str = "left_out";

/// All sealed cases of the set, marked; `files` are the paths that the seal holds. Of those that were diagnosed without their causes, too,
/// what was said in their stead.
pub fn board(folder: &Path, files: &[String], verdicts: &Path) -> Result<Board> {
    let mut board = Board::default();
    for name in files
        .iter()
        .filter(|name| Path::new(name).starts_with(SEALED))
    {
        let path = folder.join(name);
        let truth: Truth =
            read(&path).map_err(|why| Error::data(path.display().to_string(), why))?;
        let file = path.file_name().unwrap_or_default();
        match read::<Answer>(&verdicts.join(file)) {
            Ok(answer) => {
                let without = read::<Answer>(&verdicts.join(LEFT_OUT).join(file)).ok();
                let without = without.and_then(|without| left_out(&truth, &answer, &without));
                board.left_out.extend(without);
                board.cases.push(mark(&truth, &answer));
            }
            Err(why) => board.missing.push((truth.case, why)),
        }
    }
    Ok(board)
}

/// The cause to leave out of a recording whose truth lies at `path`; none where no single cause of the list is concealed.
pub fn single_cause(path: &Path) -> Result<Option<String>> {
    let truth: Truth = read(path).map_err(|why| Error::data(path.display().to_string(), why))?;
    let mut effects = truth.effects.iter();
    let listed = truth.content == "single" && effects.all(|cause| cause.effect != NAMELESS);
    let mut wanted = truth
        .effects
        .into_iter()
        .filter(|cause| cause.wanted && listed);
    Ok(wanted.next().map(|cause| cause.effect))
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
        said: case.strays.first().cloned(),
        strays: case.strays.len() as i64,
        verdict: case.verdict.clone(),
        heldout_before_mm: case.held_out.map(|held_out| held_out.before),
        heldout_after_mm: case.held_out.map(|held_out| held_out.after),
        heldout_bound_mm: case.held_out.map(|held_out| held_out.bound),
        ..Default::default()
    };
    if case.causes.is_empty() {
        return vec![row(0, None)];
    }
    let of_cause = |(number, cause): (usize, &Marked)| ScoreboardRow {
        place: Some(cause.place.clone()),
        form: Some(cause.form.clone()),
        visibility: Some(cause.strength),
        outcome: Some(cause.outcome.name().into()),
        place_right: Some(cause.placed.place),
        name_or_unknown: Some(cause.placed.name_or_unknown),
        wrong_name: Some(cause.placed.wrong_name),
        ..row(number, Some(cause.effect.clone()))
    };
    case.causes.iter().enumerate().map(of_cause).collect()
}

/// One row per concealed effect, as Parquet.
pub fn write_scoreboard(path: &Path, board: &Board) -> Result<()> {
    let frame = Scoreboard(board.cases.iter().flat_map(rows).collect()).to_frame()?;
    let fault = |error: &dyn Display| {
        Error::store(
            path.display().to_string(),
            format!("cannot be written: {error}"),
        )
    };
    let file = std::fs::File::create(path).map_err(|error| fault(&error))?;
    let written =
        ArrowWriter::try_new(file, frame.batch().schema(), None).and_then(|mut writer| {
            writer.write(frame.batch())?;
            writer.close()
        });
    written.map(drop).map_err(|error| fault(&error))
}
