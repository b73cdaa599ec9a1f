//! The trail: runs told, explained, compared, their tables asked in SQL and traced to where they come from, what nothing keeps swept.

mod diagnosis;
mod explain;
mod keep;
mod lineage;
mod query;
mod runs;

pub use diagnosis::{diagnosis, the_stage};
pub use explain::{Explanation, explain};
pub use keep::kept_actions;
pub use lineage::{Made, Node, lineage};
pub use query::{Answer, QueryColumn, QueryTable, QueryTables, Value, query};
pub use runs::{Place, RunDiff, Setting, TableChange, Told, compare_runs};
