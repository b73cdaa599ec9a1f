//! SQL over the tables of a run: polars reads the store's objects where they lie, and of them only what is asked for.
//!
//! Tables go by `stage_port`, `stage.port` or, where one stage alone writes such a table, by their kind. Rows come in the order of
//! their tables unless `ORDER BY` says otherwise.

use crate::audit::runs::{QueryTable, QueryTables};
use crate::error::{Error, Result, suggestion};
use crate::store::Store;
use polars::prelude::{
    AnyValue, Column, DataFrame, DslPlan, JoinType, LazyFrame, MaintainOrderJoin, PlRefPath,
    PolarsError, PolarsResult, ScanArgsParquet, UniqueKeepStrategy,
};
use polars::sql::SQLContext;
use sqlparser::ast::{
    Expr, Ident, JoinOperator, ObjectName, ObjectNamePart, Query, SetExpr, TableFactor,
    TableWithJoins, VisitMut, VisitorMut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

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
    let mut plan = context.execute(sql)?.logical_plan;
    keep_order(&mut plan);
    LazyFrame::from(plan).collect()
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

/// Sets every step of a plan that may lose the order to keep it.
fn keep_order(plan: &mut DslPlan) {
    // What polars noted about a plan while it read the SQL; it does so again.
    while let DslPlan::IR { dsl, .. } = plan {
        *plan = Arc::unwrap_or_clone(std::mem::take(dsl));
    }
    match plan {
        DslPlan::GroupBy { maintain_order, .. } => *maintain_order = true,
        DslPlan::Join { options, .. } => {
            let args = &mut Arc::make_mut(options).args;
            args.maintain_order = match args.how {
                JoinType::Inner | JoinType::Left | JoinType::Full => MaintainOrderJoin::LeftRight,
                JoinType::Right => MaintainOrderJoin::RightLeft,
                JoinType::Semi | JoinType::Anti => MaintainOrderJoin::Left,
                // Every row with every row: in order by themselves.
                _ => args.maintain_order,
            };
        }
        DslPlan::Distinct { options, .. } => {
            options.maintain_order = true;
            if matches!(options.keep_strategy, UniqueKeepStrategy::Any) {
                options.keep_strategy = UniqueKeepStrategy::First;
            }
        }
        DslPlan::Sort { sort_options, .. } => sort_options.maintain_order = true,
        DslPlan::Union { args, .. } => args.maintain_order = true,
        _ => {}
    }
    match plan {
        DslPlan::Union { inputs, .. } => inputs.iter_mut().for_each(keep_order),
        DslPlan::Join {
            input_left,
            input_right,
            ..
        } => [input_left, input_right]
            .into_iter()
            .for_each(|input| keep_order(Arc::make_mut(input))),
        DslPlan::GroupBy { input, .. }
        | DslPlan::Distinct { input, .. }
        | DslPlan::Sort { input, .. }
        | DslPlan::Filter { input, .. }
        | DslPlan::Select { input, .. }
        | DslPlan::HStack { input, .. }
        | DslPlan::Slice { input, .. }
        | DslPlan::MapFunction { input, .. }
        | DslPlan::Cache { input, .. } => keep_order(Arc::make_mut(input)),
        _ => {}
    }
}

/// The rows that a query gave.
#[derive(Debug)]
pub struct QueryResult(DataFrame);

/// One value of an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum QueryValue<'a> {
    /// Missing.
    Null,
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i128),
    /// A number.
    Number(f64),
    /// Text.
    Text(Cow<'a, str>),
}

impl QueryResult {
    pub(crate) fn new(frame: DataFrame) -> Self {
        Self(frame)
    }

    /// How many.
    pub fn rows(&self) -> usize {
        self.0.height()
    }

    /// Names of the columns, in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.columns().iter().map(|column| column.name().as_str())
    }

    /// The values of a row, counted from 0, in the order of the names.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = QueryValue<'_>> {
        self.0
            .columns()
            .iter()
            .map(move |column| value(column, row))
    }

    /// The first `rows` values of every column.
    pub fn columns(&self, rows: usize) -> impl Iterator<Item = Vec<QueryValue<'_>>> {
        let rows = rows.min(self.rows());
        self.0
            .columns()
            .iter()
            .map(move |column| (0..rows).map(|row| value(column, row)).collect())
    }
}

fn value(column: &Column, row: usize) -> QueryValue<'_> {
    let Ok(value) = column.get(row) else {
        return QueryValue::Null;
    };
    match value {
        AnyValue::Null => QueryValue::Null,
        AnyValue::Boolean(truth) => QueryValue::Boolean(truth),
        AnyValue::String(text) => QueryValue::Text(text.into()),
        AnyValue::StringOwned(text) => QueryValue::Text(text.to_string().into()),
        AnyValue::Float64(number) => QueryValue::Number(number),
        AnyValue::Float32(number) => QueryValue::Number(number.into()),
        AnyValue::Int8(number) => QueryValue::Integer(number.into()),
        AnyValue::Int16(number) => QueryValue::Integer(number.into()),
        AnyValue::Int32(number) => QueryValue::Integer(number.into()),
        AnyValue::Int64(number) => QueryValue::Integer(number.into()),
        AnyValue::Int128(number) => QueryValue::Integer(number),
        AnyValue::UInt8(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt16(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt32(number) => QueryValue::Integer(number.into()),
        AnyValue::UInt64(number) => QueryValue::Integer(number.into()),
        // Dates, lists and what else a query may make: as polars writes them.
        other => QueryValue::Text(other.to_string().into()),
    }
}

/// The fault of a query over `tables`, each a name with its columns.
pub(crate) fn fault_of(error: &PolarsError, tables: &[(&str, Vec<String>)]) -> Error {
    match error {
        PolarsError::Context { error, .. } | PolarsError::ExprContext { error, .. } => {
            fault_of(error, tables)
        }
        _ => {
            let text = error.to_string();
            let message = missing(&text)
                .and_then(|name| unknown(name, tables))
                .unwrap_or_else(|| first(&text));
            Error::spec("SQL", message)
        }
    }
}

/// The column that polars did not find, if that is what it says.
fn missing(text: &str) -> Option<&str> {
    let after = [
        "unable to find column \"",
        "no column named '",
        "no table or struct column named '",
    ];
    let tail = after
        .into_iter()
        .find_map(|words| text.split_once(words))?
        .1;
    tail.split(['"', '\'']).next()
}

/// Nothing where a table has the column: then it is lost on the way, and polars says where.
fn unknown(name: &str, tables: &[(&str, Vec<String>)]) -> Option<String> {
    let all = || {
        tables
            .iter()
            .flat_map(|(_, columns)| columns)
            .map(String::as_str)
    };
    if tables.is_empty() || all().any(|column| column == name) {
        return None;
    }
    let hint = suggestion(name, all());
    let known: Vec<String> = tables
        .iter()
        .map(|(table, columns)| format!("{table}: {}", columns.join(", ")))
        .collect();
    Some(format!(
        "no column `{name}`{hint} Columns of {}",
        known.join("; of ")
    ))
}

/// Without the plan that polars prints below.
fn first(text: &str) -> String {
    text.split("\n\n").next().unwrap_or(text).trim().to_string()
}

pub(crate) struct Statement<'t> {
    /// With `stage.port` written as one name.
    pub(crate) text: String,
    /// The run's tables that it names, by the name that `text` has for them.
    pub(crate) tables: BTreeMap<String, &'t QueryTable>,
}

impl<'t> Statement<'t> {
    /// Reads one SELECT; whatever would change a table is refused, and a table that the run has not.
    pub(crate) fn read(sql: &str, tables: &'t QueryTables) -> Result<Self> {
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
                // A name in one part stays as it was written: columns may be qualified by it.
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
pub(crate) fn check(query: &Query, tables: &QueryTables) -> Result<()> {
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
