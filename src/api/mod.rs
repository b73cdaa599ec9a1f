//! calib from arrays: a robot and a recording, and what the stages of a pipeline make of them, in memory.
//!
//! Nothing is computed here: the stages `split`, `identify` and `diagnose` run with the settings and defaults of a pipeline, so that equal
//! arrays give equal numbers to the last digit. Arrays are row-major and carry their units in their names: `_rad`, `_mm`, `_kg`, `_c`,
//! `_s`; the position of a joint that slides is in mm. Rows count from 0 in errors, joints from 1.

mod diagnosis;
mod model;
mod recording;
mod robot;
mod run;

pub use diagnosis::{Diagnosis, diagnose};
pub use model::{Compensated, Identified, Model, identify};
pub use recording::{Poses, Recording, Sigma};
pub use robot::Robot;
pub use run::{CalibRun, RunRequest, run};

use crate::error::Result;
use crate::pipeline::{Observer, StageCall, StageTables, Unwatched, run_in_memory};
use serde_json::{Value, json};

/// How an identification or a diagnosis is made.
pub struct Options<'a> {
    /// Settings of the stage, as `with:` of a pipeline.
    pub with: Value,
    /// That of the pipeline; `calib init` writes 1.
    pub seed: u64,
    /// Who watches.
    pub observer: &'a dyn Observer,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self::with(json!({}))
    }
}

impl Options<'_> {
    /// Settings of the stage, all else as usual.
    pub fn with(with: Value) -> Self {
        Self {
            with,
            seed: 1,
            observer: &Unwatched,
        }
    }

    /// Runs a stage on robot and recording, split as the recording says.
    fn run(&self, uses: &str, robot: &Robot, recording: &Recording) -> Result<StageTables> {
        let recorded = recording.table(robot)?;
        let call = |uses, with| StageCall {
            uses,
            with,
            seed: self.seed,
        };
        let how = recording.split();
        let split = run_in_memory(
            &call("split", &how),
            std::slice::from_ref(&recorded),
            self.observer,
        )?;
        let mut tables = vec![robot.table()?, recorded];
        tables.extend(split.tables.into_iter().map(|(_, frame)| frame));
        let mut given = run_in_memory(&call(uses, &self.with), &tables, self.observer)?;
        given.warnings.splice(0..0, split.warnings);
        Ok(given)
    }
}
