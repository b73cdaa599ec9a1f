//! `calib query`: the tables of a run asked in SQL.
//!
//! `calib schema`: the tables with their columns and units, and the JSON Schema of the pipeline's YAML.
//!
//! `calib effects`: the library of effects, in words.
//!
//! `calib robots`: the library of common arms.

use crate::audit::{QueryTable, QueryTables};
use crate::cli::pipeline_arguments::reported_as;
use crate::cli::surroundings::open_store;
use crate::cli::{emit, emit_json};
use crate::effect::{CAUSES, Cause, cause};
use crate::error::{Error, Result, counted, nearest};
use crate::pipeline::{Manifest, find_run};
use crate::robot::{LIBRARY, LibraryArm};
use crate::stage::STAGES;
use crate::store::schema::{self, TableSchema};
use crate::store::{Loose, Store, read_table};
use crate::summary::effects_json;
use crate::units::Unit;
use crate::{pipeline, summary};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

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
    pub(crate) fn run(&self) -> Result<()> {
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
        _ => {
            let rows = Some(arguments.rows).filter(|rows| *rows > 0);
            let width = super::surroundings::columns();
            emit(&summary::grid(&answer, rows.unwrap_or(usize::MAX), width))
        }
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
    let tables = summary::columns(store, tables)?;
    match json {
        true => emit_json(&tables),
        false => emit(&summary::columns_text(&tables)),
    }
}

/// Show what tables hold, and the schema of the pipeline's YAML.
#[derive(Args)]
#[command(after_help = "Examples:
  calib schema list
  calib schema show prediction
  calib schema check .calib/tables/sr210d/joint.prediction.parquet
  calib schema pipeline > schemas/pipeline.v1.schema.json
  calib schema fleet > schemas/fleet.v1.schema.json")]
pub(super) struct SchemaArguments {
    #[command(subcommand)]
    verb: SchemaVerb,
}

#[derive(Subcommand)]
enum SchemaVerb {
    /// All tables, one a line
    #[command(after_help = "Examples:\n  calib schema list | grep torque")]
    List,
    /// The columns of a table with type, unit and meaning
    #[command(after_help = "Examples:\n  calib schema show recording")]
    Show {
        /// The table's kind, e.g. `recording`
        kind: String,
    },
    /// Checks a table's file: columns, types, units' columns, ranges, key, no NaN
    #[command(
        after_help = "Examples:\n  calib schema check prediction.parquet\n  calib schema check points.parquet --as recording"
    )]
    Check {
        /// A Parquet file
        file: PathBuf,
        /// The table that it is, where it does not say so itself
        #[arg(long = "as", value_name = "KIND")]
        kind: Option<String>,
    },
    /// The JSON Schema of the pipeline's YAML, for editors
    #[command(after_help = "Examples:\n  calib schema pipeline > pipeline.schema.json")]
    Pipeline,
    /// The JSON Schema of FLEET.yaml, for editors
    #[command(after_help = "Examples:\n  calib schema fleet > fleet.schema.json")]
    Fleet,
}

impl SchemaArguments {
    pub(crate) fn run(&self) -> Result<()> {
        match &self.verb {
            SchemaVerb::List => emit(&list()),
            SchemaVerb::Show { kind } => emit(&show(find(kind)?)),
            SchemaVerb::Fleet => emit(&crate::fleet::file::json_schema()),
            SchemaVerb::Check { file, kind } => check(file, kind.as_deref()),
            SchemaVerb::Pipeline => emit(&pipeline::json_schema(STAGES)),
        }
    }
}

fn check(file: &Path, kind: Option<&str>) -> Result<()> {
    let kind = kind
        .map(find)
        .transpose()?
        .map(|schema| schema.name.as_str());
    let Loose { table, vouched } = read_table(file, kind)?;
    let hash = if vouched {
        ""
    } else {
        " (the file carries no content hash: its content cannot be verified)"
    };
    emit(&format!(
        "{}: sound, {}, {}{hash}\n",
        table.schema().id(),
        counted(table.rows(), "row"),
        table.table_hash()
    ))
}

fn list() -> String {
    let schemas = || schema::all();
    let width = schemas().map(|schema| schema.name.len()).max().unwrap_or(0);
    let line = |schema: &TableSchema| {
        let (name, version, description) = (&schema.name, &schema.version, &schema.description);
        format!("{name:width$}  {version}  {description}\n")
    };
    schemas().map(line).collect()
}

fn find(kind: &str) -> Result<&'static TableSchema> {
    let unknown = || {
        let kinds: Vec<&str> = schema::all().map(|schema| schema.name.as_str()).collect();
        let hint = nearest(kind, kinds.iter().copied());
        let hint = hint.map_or(".".into(), |near| format!("; did you mean `{near}`?"));
        let message = format!("no table `{kind}`{hint} Allowed: {}", kinds.join(", "));
        Error::spec("KIND", message)
    };
    schema::all()
        .find(|schema| schema.name == kind)
        .ok_or_else(unknown)
}

fn show(schema: &TableSchema) -> String {
    let (name, version, description) = (&schema.name, &schema.version, &schema.description);
    let [key, sort] = [&schema.primary_key, &schema.sort].map(|columns| columns.join(", "));
    let mut text = format!("{name} {version}: {description}\nkey: {key}; sorted by: {sort}\n\n");
    let names = schema.fields.iter().map(|field| field.name.len());
    let width = names.max().unwrap_or(0);
    for field in &schema.fields {
        let (name, description) = (&field.name, &field.description);
        let kind = format!("{:?}", field.column_type).to_lowercase();
        let null = if field.nullable { "or null" } else { "" };
        let unit = field.unit.as_deref().unwrap_or("");
        text += &format!("{name:width$}  {kind:7} {null:7}  {unit:6}  {description}\n");
    }
    text
}

/// List the effects that calib knows: formula, usual size, what each is confounded with, and what a recording needs to show it.
#[derive(Args)]
#[command(after_help = "Examples:
  calib effects
  calib effects backlash
  calib effects --json")]
pub(super) struct EffectsArguments {
    /// One effect by its name
    #[arg(value_name = "EFFECT")]
    name: Option<String>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl EffectsArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let chosen: Vec<&Cause> = match &self.name {
            None => CAUSES.to_vec(),
            Some(name) => vec![cause(name).ok_or_else(|| unknown(name))?],
        };
        if self.json {
            return emit_json(&effects_json(&chosen));
        }
        let text: Vec<String> = chosen.iter().map(|about| entry(about)).collect();
        emit(&text.join("\n"))
    }
}

fn entry(about: &Cause) -> String {
    let measure = about.measure.map(|measure| measure.advice);
    let lines = [
        ("formula", Some(about.formula)),
        ("usual size", Some(about.size)),
        ("confounded", Some(about.confounded)),
        ("needs", Some(about.needs)),
        ("measure", measure),
    ];
    let lines = lines
        .into_iter()
        .filter_map(|(name, text)| Some((name, text?)));
    let lines: String = lines
        .map(|(name, text)| format!("  {name:10}  {text}\n"))
        .collect();
    format!("{} ({})\n{lines}", about.name, about.place)
}

fn unknown(name: &str) -> Error {
    let names: Vec<&str> = CAUSES.iter().map(|cause| cause.name()).collect();
    Error::spec(
        "EFFECT",
        format!("no effect `{name}`; allowed: {}", names.join(", ")),
    )
}

/// List the arms that `calib init` starts from, or print the robot file of one.
#[derive(Args)]
#[command(after_help = "Examples:
  calib robots
  calib robots ur10e
  calib init cell7 --data measurements.csv --robot ur10e")]
pub(super) struct RobotsArguments {
    /// One arm by its name: its robot file, with sources
    #[arg(value_name = "NAME")]
    name: Option<String>,
}

impl RobotsArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let Some(name) = &self.name else {
            return emit(&library()?);
        };
        emit(LibraryArm::named(name)?.text)
    }
}

fn library() -> Result<String> {
    let line = |name: &str, arm: &str, joints: &str, reach: &str, holds: &str| {
        let line = format!("{name:<16} {arm:<40} {joints:>6} {reach:>9}  {holds}");
        line.trim_end().to_string() + "\n"
    };
    let mut out = line("name", "arm", "joints", "reach mm", "in the file");
    for arm in LIBRARY {
        let read = arm.read()?;
        let in_mm = |reach| Unit::Millimetre.from_si(reach).round().to_string();
        let holds = [
            (
                read.robot.joints.iter().any(|joint| joint.mass.is_some()),
                "masses",
            ),
            (read.about.counting().is_some(), "coupled counting"),
        ];
        let holds = holds
            .into_iter()
            .filter_map(|(there, what)| there.then_some(what));
        out += &line(
            arm.name,
            &read.robot.name,
            &read.robot.joints.len().to_string(),
            &read.about.reach.map_or("-".into(), in_mm),
            &holds.collect::<Vec<_>>().join(", "),
        );
    }
    Ok(out)
}
