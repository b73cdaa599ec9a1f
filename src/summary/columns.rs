//! The tables of a run with their columns: those of one kind together, since they have the same.

use crate::audit::{QueryColumn, QueryTable};
use crate::effect::Cause;
use crate::error::Result;
use crate::store::Store;
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use serde::Serialize;
use serde_json::{Value, json};

/// A table with its columns, as JSON has it.
#[derive(Serialize)]
pub struct TableColumns<'a> {
    table: &'a str,
    short: Option<&'a str>,
    stage: &'a str,
    port: &'a str,
    kind: &'a str,
    rows: u64,
    columns: Vec<QueryColumn>,
    #[serde(skip)]
    description: &'a str,
}

/// Tables with their columns. Fails where one has left the store.
pub fn columns<'a>(store: &Store, tables: &[&'a QueryTable]) -> Result<Vec<TableColumns<'a>>> {
    let of_table = |table: &&'a QueryTable| {
        Ok(TableColumns {
            table: &table.name,
            short: table.short.as_deref(),
            stage: &table.stage,
            port: &table.port,
            kind: &table.kind,
            rows: table.table.rows,
            columns: table.columns(store)?,
            description: table.schema().map_or("", |schema| &schema.description),
        })
    };
    tables.iter().map(of_table).collect()
}

/// The same as text.
pub fn columns_text(tables: &[TableColumns]) -> String {
    let mut kinds: Vec<&str> = Vec::new();
    for table in tables {
        if !kinds.contains(&table.kind) {
            kinds.push(table.kind);
        }
    }
    let groups = kinds.into_iter().map(|kind| {
        let of_kind = tables.iter().filter(|table| table.kind == kind);
        let of_kind: Vec<&TableColumns> = of_kind.collect();
        let mut columns: Vec<&QueryColumn> = Vec::new();
        for column in of_kind.iter().flat_map(|table| &table.columns) {
            if columns.iter().all(|known| known.name != column.name) {
                columns.push(column);
            }
        }
        let names = of_kind.iter().map(|table| table.table.len());
        json!({
            "kind": kind, "description": of_kind[0].description, "table_width": names.max(), "tables": of_kind,
            "width": columns.iter().map(|column| column.name.len()).max().unwrap_or(0), "columns": columns,
        })
    });
    let groups = Serde(groups.collect::<Vec<_>>());
    filled(include_str!("text/columns.txt"), context! { groups })
}

/// Name, formula, usual size, what each is confounded with, and what a recording needs to show it.
pub fn effects_json(causes: &[&Cause]) -> Value {
    let one = |about: &&Cause| {
        json!({
            "name": about.name, "place": about.place, "formula": about.formula, "size": about.size,
            "confounded": about.confounded, "needs": about.needs,
            "measure": about.measure.map(|measure| measure.advice),
        })
    };
    causes.iter().map(one).collect()
}
