//! What a run, its tables, its diagnosis and the difference of two runs say, as text and as JSON; nothing is printed here.

mod changed;
mod columns;
mod diagnosis;
mod diagnosis_head;
mod diagnosis_page;
mod effect_file;
mod estimate;
mod found;
#[cfg(feature = "query")]
mod grid;
mod run;
mod run_diff;
mod run_result;
mod screen;

pub use columns::{columns, columns_text, effects_json};
pub use diagnosis::DiagnosisSummary;
pub(crate) use diagnosis::Subject;
pub(crate) use diagnosis_page::diagnosis_page;
#[cfg(feature = "query")]
pub use grid::grid;
#[cfg(feature = "query")]
pub use grid::{csv, json};
pub use run::LimitsSummary;
pub use run::{explanation, first_look, graph, run, scoreboard, stage, status};
pub use run_diff::run_diff;
pub use run_diff::{RivalChange, rival_changes};
pub use run_result::{ResultScreen, RunResult, rejected};
pub use screen::{LABEL, folded, labelled};

use crate::error::Result;
use crate::pipeline::{Manifest, StageReport};
use crate::store::Store;
use crate::table::{Robot, Table};

/// All tables of a kind that a run wrote. Fails where one has left the store.
fn tables<T: Table>(manifest: &Manifest, store: &Store) -> Result<Vec<T>> {
    manifest
        .tables(T::KIND)
        .map(|output| T::from_frame(&store.load(&output.table)?))
        .collect()
}

/// The name of the robot that a stage read; none where it read none. Fails where its table has left the store.
fn robot_of(stage: &StageReport, store: &Store) -> Result<Option<String>> {
    let Some(robot_input) = stage.inputs.iter().find(|input| input.port == Robot::KIND) else {
        return Ok(None);
    };
    let robot = Robot::from_frame(&store.load(&robot_input.table)?)?;
    Ok(robot.0.into_iter().next().map(|base| base.name))
}
