//! What a run, its tables, its diagnosis and the difference of two runs say, as text and as JSON; nothing is printed here.

mod columns;
mod diagnosis;
mod effects;
mod estimate;
mod explanation;
mod first_look;
#[cfg(feature = "query")]
mod grid;
mod in_short;
mod labelled;
mod limits;
#[cfg(feature = "query")]
mod lines;
mod own_effect;
mod plan;
mod rival_changes;
mod run;
mod run_diff;
mod screen;
mod short_finding;
mod statistics;

pub use columns::{columns, columns_json};
pub use diagnosis::DiagnosisSummary;
pub use effects::effects_json;
pub use explanation::explanation;
pub use first_look::first_look;
#[cfg(feature = "query")]
pub use grid::grid;
pub use in_short::{ResultScreen, in_short};
pub use labelled::{LABEL, folded, labelled};
pub use limits::LimitsSummary;
#[cfg(feature = "query")]
pub use lines::{csv, json};
pub use plan::graph;
pub use rival_changes::{RivalChange, rival_changes};
pub use run::{run, stage, status};
pub use run_diff::run_diff;
pub use statistics::{
    corrections, corrections_rows, rejected, rejected_rows, searches, searches_rows, statistics,
    statistics_rows,
};

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
    let Some(own) = stage.inputs.iter().find(|input| input.port == Robot::KIND) else {
        return Ok(None);
    };
    let robot = Robot::from_frame(&store.load(&own.table)?)?;
    Ok(robot.0.into_iter().next().map(|base| base.name))
}
