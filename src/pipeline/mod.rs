//! The YAML, the plan, the run: `spec` reads and types, `wiring` and `plan` connect, `run` does what is not already done.

mod execute;
mod globs;
mod history;
mod identity;
mod in_memory;
mod lock;
mod look;
mod manifest;
mod options;
mod overrides;
mod place;
pub mod plan;
mod preview;
mod reason;
mod run;
mod run_state;
mod schema;
mod select;
mod services;
mod sets;
mod spec;
#[cfg(test)]
mod tests;
mod wiring;

pub use history::find_run;
pub use in_memory::{StageCall, StageTables, run_in_memory};
pub use look::{checked_plan, look};
pub use manifest::{
    Host, Manifest, OutputRecord, RunStatus, StageReport, StageStatus, Surroundings, Tool,
};
pub use options::{Purpose, RunOptions};
pub use overrides::Override;
pub use plan::Plan;
pub use preview::{Forecast, Prospect, preview};
pub use reason::{KeyChange, changes_of};
pub use run::{CompletedRun, run};
pub use schema::json_schema;
pub use select::Selection;
pub use services::{Interrupted, Observer, Unwatched};
pub(crate) use spec::misnamed;
