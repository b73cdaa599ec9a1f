//! `calib schema`: the tables with their columns and units, and the JSON Schema of the pipeline's YAML.

use super::emit;
use crate::error::{Error, Result, counted, nearest};
use crate::pipeline;
use crate::stage::STAGES;
use crate::store::schema::{self, TableSchema};
use crate::store::{Loose, read_table};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

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
    List,
    /// The columns of a table with type, unit and meaning
    Show {
        /// The table's kind, e.g. `recording`
        kind: String,
    },
    /// Checks a table's file: columns, types, units' columns, ranges, key, no NaN
    Check {
        /// A Parquet file
        file: PathBuf,
        /// The table that it is, where it does not say so itself
        #[arg(long = "as", value_name = "KIND")]
        kind: Option<String>,
    },
    /// The JSON Schema of the pipeline's YAML, for editors
    Pipeline,
    /// The JSON Schema of FLEET.yaml, for editors
    Fleet,
}

pub(super) fn main(arguments: &SchemaArguments) -> Result<()> {
    match &arguments.verb {
        SchemaVerb::List => emit(&list()),
        SchemaVerb::Show { kind } => emit(&show(find(kind)?)),
        SchemaVerb::Fleet => emit(&crate::fleet::file::json_schema()),
        SchemaVerb::Check { file, kind } => check(file, kind.as_deref()),
        SchemaVerb::Pipeline => emit(&pipeline::json_schema(STAGES)),
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
    let width = schema::all()
        .map(|schema| schema.name.len())
        .max()
        .unwrap_or(0);
    schema::all()
        .map(|schema| {
            format!(
                "{:width$}  {}  {}\n",
                schema.name, schema.version, schema.description
            )
        })
        .collect()
}

fn find(kind: &str) -> Result<&'static TableSchema> {
    schema::all()
        .find(|schema| schema.name == kind)
        .ok_or_else(|| {
            let kinds: Vec<&str> = schema::all().map(|schema| schema.name.as_str()).collect();
            let hint = nearest(kind, kinds.iter().copied())
                .map(|near| format!("; did you mean `{near}`?"));
            Error::spec(
                "KIND",
                format!(
                    "no table `{kind}`{} Allowed: {}",
                    hint.unwrap_or_else(|| ".".into()),
                    kinds.join(", ")
                ),
            )
        })
}

fn show(schema: &TableSchema) -> String {
    let mut text = format!(
        "{} {}: {}\n",
        schema.name, schema.version, schema.description
    );
    text.push_str(&format!(
        "key: {}; sorted by: {}\n\n",
        schema.primary_key.join(", "),
        schema.sort.join(", ")
    ));
    let width = schema
        .fields
        .iter()
        .map(|field| field.name.len())
        .max()
        .unwrap_or(0);
    for field in &schema.fields {
        let kind = format!("{:?}", field.column_type).to_lowercase();
        let null = if field.nullable { "or null" } else { "" };
        let unit = field.unit.as_deref().unwrap_or("");
        text.push_str(&format!(
            "{:width$}  {kind:7} {null:7}  {unit:6}  {}\n",
            field.name, field.description
        ));
    }
    text
}
