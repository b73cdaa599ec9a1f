//! `calib query`: the tables of a run asked in SQL.

use super::pipeline_arguments::reported_as;
use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::audit::{QueryTable, QueryTables};
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, find_run};
use crate::store::Store;
use crate::summary;
use clap::Args;
use std::path::PathBuf;

/// Ask the tables of a run in SQL; without SQL, list them with their columns.
///
/// A table is called stage_port (or stage.port), and also by its kind where one stage alone writes such a table: recording. SQL is
/// that of polars: SELECT with WHERE, GROUP BY, HAVING, JOIN, WITH, window functions, ORDER BY, LIMIT. Names are case-sensitive;
/// "set", "order" and other words of SQL stand in double quotes where they are columns. ORDER BY decides the order of rows; without it
/// they come in the order of the table, groups in that of their first rows. AS names a column; without it the expression is its name.
#[derive(Args)]
#[command(after_help = "Examples:
  calib query HEAD
  calib query HEAD geometry_prediction
  calib query HEAD 'SELECT step, \"set\", max(error_mm) FROM geometry.prediction GROUP BY step, \"set\"'
  calib query HEAD 'SELECT point_id, error_mm, x_mm, y_mm FROM joint_prediction ORDER BY error_mm DESC LIMIT 5'
  calib query released 'SELECT * FROM recording' --csv > recording.csv
  calib query HEAD~1 'SELECT a.sequence, a.error_mm - b.error_mm AS gain_mm
                      FROM nominal_prediction a JOIN geometry_prediction b ON a.sequence = b.sequence' --json")]
pub(super) struct QueryArguments {
    /// A run, as `calib log` names it
    #[arg(value_name = "RUN", default_value = "HEAD")]
    run: String,
    /// One SELECT; or the name of a table, to see its columns
    #[arg(value_name = "SQL")]
    sql: Option<String>,
    /// Rows to print; 0 prints all
    #[arg(long, value_name = "N", default_value_t = 50, conflicts_with_all = ["csv", "json"])]
    rows: usize,
    /// Prints every row as CSV
    #[arg(long, requires = "sql", conflicts_with = "json")]
    csv: bool,
    /// Prints every row as an object of one JSON array
    #[arg(long)]
    json: bool,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
}

impl QueryArguments {
    pub fn run(&self) -> Result<()> {
        reported_as(self.json, execute(self))
    }
}

fn execute(arguments: &QueryArguments) -> Result<()> {
    let run = arguments.run.as_str();
    if run.contains(char::is_whitespace) {
        return Err(Error::spec(
            "RUN",
            "the run comes before the SQL: calib query HEAD \"SELECT ...\"",
        ));
    }
    let store = open_store(arguments.store.as_deref())?;
    let tables = QueryTables::of(&Manifest::of(&store, &find_run(&store, run)?)?);
    let Some(sql) = arguments.sql.as_deref().map(str::trim) else {
        return columns(&store, &tables.iter().collect::<Vec<_>>(), arguments.json);
    };
    if !sql.is_empty() && !sql.contains(char::is_whitespace) && !arguments.csv {
        return columns(&store, &[tables.find(sql)?], arguments.json);
    }
    answer(arguments, &store, &tables, sql)
}

#[cfg(feature = "query")]
fn answer(
    arguments: &QueryArguments,
    store: &Store,
    tables: &QueryTables,
    sql: &str,
) -> Result<()> {
    let answer = crate::audit::query(store, tables, sql)?;
    match (arguments.csv, arguments.json) {
        (true, _) => emit(&summary::csv(&answer)?),
        (_, true) => emit(&summary::json(&answer)?),
        _ => emit(&summary::grid(
            &answer,
            if arguments.rows == 0 {
                usize::MAX
            } else {
                arguments.rows
            },
            super::surroundings::columns(),
        )),
    }
}

#[cfg(not(feature = "query"))]
fn answer(_: &QueryArguments, _: &Store, _: &QueryTables, _: &str) -> Result<()> {
    Err(Error::spec(
        "SQL",
        "this calib was built without it; build it with its default features, or ask the Parquet files that `calib show` names",
    ))
}

/// The tables with their columns.
fn columns(store: &Store, tables: &[&QueryTable], json: bool) -> Result<()> {
    if json {
        emit_json(&summary::columns_json(store, tables)?)
    } else {
        emit(&summary::columns(store, tables)?)
    }
}
