//! The tables of a run with their columns: those of one kind together, since they have the same.
//!
//! The library of effects for other programs.

use crate::audit::{QueryColumn, QueryTable};
use crate::effect::Cause;
use crate::error::{Result, counted};
use crate::store::Store;
use serde_json::{Value, json};

/// Tables with their columns, as JSON.
pub fn columns_json(store: &Store, tables: &[&QueryTable]) -> Result<Value> {
    tables
        .iter()
        .map(|table| object(store, table))
        .collect::<Result<Vec<Value>>>()
        .map(Value::from)
}

/// Tables with their columns, as text.
pub fn columns(store: &Store, tables: &[&QueryTable]) -> Result<String> {
    let mut groups: Vec<(&str, Vec<&QueryTable>)> = Vec::new();
    for table in tables {
        match groups.iter_mut().find(|(kind, _)| *kind == table.kind) {
            Some((_, group)) => group.push(table),
            None => groups.push((&table.kind, vec![table])),
        }
    }
    let texts = groups
        .iter()
        .map(|(kind, group)| text(store, kind, group))
        .collect::<Result<Vec<String>>>()?;
    Ok(if texts.is_empty() {
        "the run has no tables\n".into()
    } else {
        texts.join("\n")
    })
}

fn object(store: &Store, table: &QueryTable) -> Result<Value> {
    Ok(json!({
        "table": table.name, "short": table.short, "stage": table.stage, "port": table.port, "kind": table.kind,
        "rows": table.table.rows, "columns": table.columns(store)?,
    }))
}

fn text(store: &Store, kind: &str, tables: &[&QueryTable]) -> Result<String> {
    let description = tables
        .iter()
        .find_map(|table| table.schema())
        .map_or("", |schema| &schema.description);
    let mut text = format!("{kind}: {description}\n");
    let width = tables
        .iter()
        .map(|table| table.name.len())
        .max()
        .unwrap_or(0);
    let mut columns: Vec<QueryColumn> = Vec::new();
    for table in tables {
        let short = table
            .short
            .as_ref()
            .map_or_else(String::new, |short| format!(", also `{short}`"));
        text.push_str(&format!(
            "  {:width$}  {}{short}\n",
            table.name,
            counted(table.table.rows, "row")
        ));
        for column in table.columns(store)? {
            if columns.iter().all(|known| known.name != column.name) {
                columns.push(column);
            }
        }
    }
    let width = columns
        .iter()
        .map(|column| column.name.len())
        .max()
        .unwrap_or(0);
    for column in columns {
        let unit = column.unit.as_deref().unwrap_or("");
        text.push_str(&format!(
            "    {:width$}  {:7}  {unit:5}  {}\n",
            column.name, column.column_type, column.description
        ));
    }
    Ok(text)
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
