//! A SELECT as it was written, its tables looked up among those of the run.

use sqlparser::ast::{Expr, Ident, ObjectName, ObjectNamePart, Query, VisitMut, VisitorMut};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use crate::audit::tables::{QueryTable, QueryTables};
use crate::error::{Error, Result};

/// What polars is asked.
pub(super) struct Statement<'t> {
    /// With `stage.port` written as one name.
    pub text: String,
    /// The run's tables that it names, by the name that `text` has for them.
    pub tables: BTreeMap<String, &'t QueryTable>,
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
        super::size::check(&query, tables)?;
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
