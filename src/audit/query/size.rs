//! How many rows joins without a condition would make, before anything is computed: memory that runs out ends the process.

use sqlparser::ast::{
    Ident, JoinOperator, ObjectName, ObjectNamePart, Query, SetExpr, TableFactor, TableWithJoins,
};
use std::collections::BTreeMap;

use crate::audit::tables::QueryTables;
use crate::error::{Error, Result};

/// Rows that a product of tables may have; at a dozen columns it is some gigabytes.
const MOST_ROWS: f64 = 5e7;

/// Refuses a query in which every row of some tables meets every row of others too often.
pub(super) fn check(query: &Query, tables: &QueryTables) -> Result<()> {
    rows(query, tables, &BTreeMap::new()).map(|_| ())
}

/// Rows of a `WITH` by its name.
type Given<'q> = BTreeMap<&'q str, f64>;

/// At most so many rows, but for joins with a condition, which are taken to find one partner a row.
fn rows<'q>(query: &'q Query, tables: &QueryTables, given: &Given<'q>) -> Result<f64> {
    let mut given = given.clone();
    for table in query.with.iter().flat_map(|with| &with.cte_tables) {
        let count = rows(&table.query, tables, &given)?;
        given.insert(&table.alias.name.value, count);
    }
    of_set(&query.body, tables, &given)
}

fn of_set<'q>(set: &'q SetExpr, tables: &QueryTables, given: &Given<'q>) -> Result<f64> {
    match set {
        SetExpr::Select(select) => product(&select.from, tables, given),
        SetExpr::Query(query) => rows(query, tables, given),
        SetExpr::SetOperation { left, right, .. } => {
            Ok(of_set(left, tables, given)? + of_set(right, tables, given)?)
        }
        _ => Ok(1.0),
    }
}

fn product<'q>(from: &'q [TableWithJoins], tables: &QueryTables, given: &Given<'q>) -> Result<f64> {
    let mut all: f64 = 1.0;
    for table in from {
        let mut count = of_table(&table.relation, tables, given)?;
        for join in &table.joins {
            let other = of_table(&join.relation, tables, given)?;
            count = if matches!(join.join_operator, JoinOperator::CrossJoin(_)) {
                count * other
            } else {
                count.max(other)
            };
        }
        all *= count;
    }
    if all > MOST_ROWS {
        let message = format!(
            "every row of one table with every row of the other gives {all:.1e} rows, more than {MOST_ROWS:.0e}; join by a condition, \
             e.g. JOIN ... USING (sequence), or ask for fewer rows in a subquery"
        );
        return Err(Error::spec("SQL", message));
    }
    Ok(all)
}

fn of_table<'q>(table: &'q TableFactor, tables: &QueryTables, given: &Given<'q>) -> Result<f64> {
    match table {
        TableFactor::Table { name, .. } => Ok(of_name(name, tables, given)),
        TableFactor::Derived { subquery, .. } => rows(subquery, tables, given),
        TableFactor::NestedJoin {
            table_with_joins, ..
        } => product(std::slice::from_ref(table_with_joins), tables, given),
        _ => Ok(1.0),
    }
}

/// A name that is not known is a fault of its own.
fn of_name(name: &ObjectName, tables: &QueryTables, given: &Given) -> f64 {
    let parts: Vec<&Ident> = name.0.iter().filter_map(ObjectNamePart::as_ident).collect();
    let name = parts
        .iter()
        .map(|part| part.value.as_str())
        .collect::<Vec<_>>()
        .join(".");
    let known = given.get(name.as_str()).copied();
    known
        .or_else(|| tables.find(&name).ok().map(|table| table.table.rows as f64))
        .unwrap_or(1.0)
}
