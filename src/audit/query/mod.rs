//! SQL over the tables of a run: polars reads the store's objects where they lie, and of them only what is asked for.
//!
//! Tables go by `stage_port`, `stage.port` or, where one stage alone writes such a table, by their kind. Rows come in the order of
//! their tables unless `ORDER BY` says otherwise.

mod answer;
mod order;
mod statement;

pub use answer::{QueryResult, QueryValue};

use polars::prelude::{DataFrame, LazyFrame, PlRefPath, PolarsResult, ScanArgsParquet};
use polars::sql::SQLContext;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::tables::{QueryTable, QueryTables};
use crate::error::{Error, Result};
use crate::store::Store;
use answer::fault_of;
use statement::Statement;

/// Answers one SELECT over the tables of a run; whatever is wrong with it is the asker's to mend.
pub fn query(store: &Store, tables: &QueryTables, sql: &str) -> Result<QueryResult> {
    let statement = Statement::read(sql, tables)?;
    let context = SQLContext::new();
    let mut columns = Vec::new();
    for (name, table) in &statement.tables {
        let mut frame = scan(store, table)?;
        columns.push((
            name.as_str(),
            names(&mut frame).map_err(|error| fault_of(&error, &[]))?,
        ));
        context.register(name, frame);
    }
    // What a parser lets through may still be more than polars is ready for.
    let answer = catch_unwind(AssertUnwindSafe(|| collect(context, &statement.text)));
    let frame = answer
        .map_err(|_| Error::spec("SQL", "polars cannot answer this; put it in other words"))?;
    Ok(QueryResult::new(
        frame.map_err(|error| fault_of(&error, &columns))?,
    ))
}

fn collect(mut context: SQLContext, sql: &str) -> PolarsResult<DataFrame> {
    let frame = context.execute(sql)?;
    LazyFrame::from(order::kept(frame.logical_plan)).collect()
}

/// A table of the store, not yet read; of a store in a bucket its file is fetched first.
fn scan(store: &Store, table: &QueryTable) -> Result<LazyFrame> {
    let file = table.file(store)?;
    // An object's name is a hash: what looks like a pattern is part of the folder's name.
    let options = ScanArgsParquet {
        glob: false,
        ..ScanArgsParquet::default()
    };
    let frame =
        PlRefPath::try_from_path(&file).and_then(|path| LazyFrame::scan_parquet(path, options));
    frame.map_err(|error| table.fault(&file, format!("cannot be read: {error}")))
}

fn names(frame: &mut LazyFrame) -> PolarsResult<Vec<String>> {
    Ok(frame
        .collect_schema()?
        .iter_names()
        .map(ToString::to_string)
        .collect())
}
