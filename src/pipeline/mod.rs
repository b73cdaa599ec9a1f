//! The YAML, the plan, the run: `spec` reads and types, `wiring` and `plan` connect, `run` does what is not already done.

mod look;
mod manifest;
mod overrides;
pub(crate) mod plan;
mod run;
mod run_state;
mod schema;
mod services;
mod spec;

#[cfg(test)]
mod tests;

pub use look::{Forecast, KeyChange, Prospect, changes_of, checked_plan, look, preview};
pub use manifest::{
    Host, Manifest, OutputRecord, Purpose, RunOptions, RunStatus, StageReport, StageStatus,
    Surroundings, Tool, find_run, later_diagnosis,
};
pub use overrides::Override;
pub use plan::{Plan, Selection};
pub use run::{CompletedRun, run};
pub use schema::json_schema;
pub use services::{Interrupted, Observer, Unwatched};
pub use services::{StageCall, StageTables, run_in_memory};
pub(crate) use spec::{misnamed, sort_by_place, trouble_at, unreadable_text};
