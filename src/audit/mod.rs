//! The trail: runs told, explained, compared, their tables asked in SQL and traced to where they come from, what nothing keeps swept.

mod explain;
#[cfg(feature = "query")]
mod query;
mod runs;

pub use explain::{Explanation, POSITIONS, diagnosis, explain, the_stage};
pub use explain::{LineageNode, Provenance, kept_actions, lineage};
#[cfg(feature = "query")]
pub use query::{QueryResult, QueryValue, query};
pub use runs::{QueryColumn, QueryTable, QueryTables};
pub use runs::{RunAddress, RunDiff, RunSummary, SettingChange, TableChange, compare_runs};
