//! The trail: runs told, explained, compared, their tables asked in SQL and traced to where they come from, what nothing keeps swept.

mod explain;
mod lineage;
#[cfg(feature = "query")]
mod query;
mod runs;
mod tables;

pub use explain::{Explanation, explain};
pub use explain::{POSITIONS, diagnosis, the_stage};
pub use lineage::kept_actions;
pub use lineage::{LineageNode, Provenance, lineage};
#[cfg(feature = "query")]
pub use query::{QueryResult, QueryValue, query};
pub use runs::{RunAddress, RunDiff, RunSummary, SettingChange, TableChange, compare_runs};
pub use tables::{QueryColumn, QueryTable, QueryTables};
