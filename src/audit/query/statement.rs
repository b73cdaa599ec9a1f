//! A SELECT as it was written, its tables looked up among those of the run.

use crate::audit::tables::{QueryTable, QueryTables};
use crate::error::{Error, Result};
use sqlparser::ast::{
    Expr, Ident, JoinOperator, ObjectName, ObjectNamePart, Query, SetExpr, TableFactor,
    TableWithJoins, VisitMut, VisitorMut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

/// What polars is asked.
pub(super) struct Statement<'t> {
    /// With `stage.port` written as one name.
    pub(crate) text: String,
    /// The run's tables that it names, by the name that `text` has for them.
    pub(crate) tables: BTreeMap<String, &'t QueryTable>,
}

impl<'t> Statement<'t> {
    /// Reads one SELECT; whatever would change a table is refused, and a table that the run has not.
    pub(super) fn read(sql: &str, tables: &'t QueryTables) -> Result<Self> {
        let faulty = |message: String| Error::spec("SQL", message);
        let mut statements = Parser::parse_sql(&GenericDialect {}, sql).map_err(|error| {
            faulty(
                error
                    .to_string()
                    .trim_start_matches("sql parser error: ")
                    .to_string(),
            )
        })?;
        let (Some(sqlparser::ast::Statement::Query(mut query)), None) =
            (statements.pop(), statements.pop())
        else {
            return Err(faulty(
                "expected one SELECT: the tables of a run are read, never changed".into(),
            ));
        };
        check(&query, tables)?;
        let mut names = Names {
            tables,
            local: BTreeSet::new(),
            used: BTreeMap::new(),
        };
        match query.visit(&mut names) {
            ControlFlow::Break(error) => Err(error),
            ControlFlow::Continue(()) => Ok(Self {
                text: query.to_string(),
                tables: names.used,
            }),
        }
    }
}

/// Goes through a query and looks its tables up.
struct Names<'t> {
    tables: &'t QueryTables,
    /// Names that the query gives by `WITH`.
    local: BTreeSet<String>,
    used: BTreeMap<String, &'t QueryTable>,
}

impl VisitorMut for Names<'_> {
    type Break = Error;

    fn pre_visit_query(&mut self, query: &mut Query) -> ControlFlow<Error> {
        let given = query.with.iter().flat_map(|with| &with.cte_tables);
        self.local
            .extend(given.map(|table| table.alias.name.value.clone()));
        ControlFlow::Continue(())
    }

    fn pre_visit_relation(&mut self, relation: &mut ObjectName) -> ControlFlow<Error> {
        let parts: Vec<&str> = relation
            .0
            .iter()
            .filter_map(ObjectNamePart::as_ident)
            .map(|part| part.value.as_str())
            .collect();
        if matches!(parts[..], [one] if self.local.contains(one)) {
            return ControlFlow::Continue(());
        }
        match self.tables.find(&parts.join(".")) {
            Ok(table) => {
                // A name in one part stands as it was written: columns may be told by it.
                let name = if let [one] = parts[..] {
                    one.to_string()
                } else {
                    table.name.clone()
                };
                *relation = ObjectName(vec![ObjectNamePart::Identifier(Ident::with_quote(
                    '"',
                    name.as_str(),
                ))]);
                self.used.insert(name, table);
                ControlFlow::Continue(())
            }
            Err(error) => ControlFlow::Break(error),
        }
    }

    /// `stage.port.column`.
    fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<Error> {
        if let Expr::CompoundIdentifier(parts) = expression
            && let [stage, port, column] = &parts[..]
            && let Ok(table) = self.tables.find(&format!("{}.{}", stage.value, port.value))
        {
            *parts = vec![Ident::with_quote('"', table.name.as_str()), column.clone()];
        }
        ControlFlow::Continue(())
    }
}

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
