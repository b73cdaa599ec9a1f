//! The trail: runs told, explained, compared, their tables asked in SQL and traced to where they come from, what nothing keeps swept.

mod diagnosis;
mod explain;
mod keep;
mod lineage;
#[cfg(feature = "query")]
mod query;
mod runs;
mod tables;

pub use diagnosis::{POSITIONS, diagnosis, the_stage};
pub use explain::{Explanation, explain};
pub use keep::kept_actions;
pub use lineage::{LineageNode, Provenance, lineage};
#[cfg(feature = "query")]
pub use query::{QueryResult, QueryValue, query};
pub use runs::{RunAddress, RunDiff, RunSummary, SettingChange, TableChange, compare_runs};
pub use tables::{QueryColumn, QueryTable, QueryTables};
