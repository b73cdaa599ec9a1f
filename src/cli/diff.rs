//! `calib diff`: two tables or two runs compared; exit code 0 same, 1 different beyond tolerance, 2 could not compare.

use super::{complain, emit, emit_json};
use crate::diff::{self, Detail, Options, TableDiff};
use crate::error::{Error, Result};
use clap::Args;
use std::path::{Path, PathBuf};

/// Compare two tables or two runs: which rows changed, by how much, in the column's unit and in sigmas.
///
/// Keys, tolerances and what is an angle come from the tables' schema. Rows are the same, within tolerance, changed, in one
/// table only, or have a key that is not theirs alone.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct DiffArguments {
    /// A Parquet file
    a: PathBuf,
    /// The same, to compare with
    b: PathBuf,
    /// Columns that tell rows apart, instead of those of the schema
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    key: Vec<String>,
    /// Overlooks differences up to this, in the column's unit or in one given: 0.1, x_mm=0.1, x_mm=50um
    #[arg(long, value_name = "[COLUMN=]SIZE")]
    atol: Vec<String>,
    /// Overlooks differences up to this part of the larger value
    #[arg(long, value_name = "[COLUMN=]PART")]
    rtol: Vec<String>,
    /// Leaves columns out
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    ignore: Vec<String>,
    /// Four columns that are one rotation; those called qw, qx, qy, qz are known
    #[arg(long, value_name = "W,X,Y,Z")]
    quaternion: Vec<String>,
    /// Pairs rows with the same key in their order: first with first
    #[arg(long)]
    occurrence: bool,
    /// Reads both tables though they say that their content is equal
    #[arg(long)]
    reread: bool,
    /// Worst rows to show
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(0..=1000))]
    limit: u16,
    /// Counts and columns only
    #[arg(long)]
    stat: bool,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Writes a page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Writes every cell that differs as a row of a Parquet file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Ends with code 0 also where there are differences
    #[arg(long)]
    exit_zero: bool,
}

const EXAMPLES: &str = "Examples:
  calib diff monday.parquet tuesday.parquet
  calib diff a.parquet b.parquet --key robot,pose --atol x_mm=50um --ignore remark
  calib diff a.parquet b.parquet --stat --out cells.parquet

Exit codes: 0 same; 1 different beyond tolerance; 2 could not compare, or keys that occur twice.";

pub(super) fn main(arguments: &DiffArguments) -> u8 {
    match execute(arguments) {
        Ok(code) => code,
        Err(error @ Error::Bug(_)) => complain(&error),
        Err(error) => {
            complain(&error);
            2
        }
    }
}

fn execute(arguments: &DiffArguments) -> Result<u8> {
    let options = options(arguments)?;
    let diff = diff::compare(&arguments.a, &arguments.b, &options)?;
    if arguments.json {
        emit_json(&json(&diff)?)?;
    } else {
        emit(&diff::text(&diff, if arguments.stat { Detail::Stat } else { Detail::Full }))?;
    }
    let code = if diff.duplicates() > 0 { 2 } else { u8::from(!diff.is_same()) };
    if let Some(path) = &arguments.html {
        write(path, &diff::html("calib diff", &[], &[("tables".into(), diff)])?)?;
    }
    Ok(if arguments.exit_zero && code == 1 { 0 } else { code })
}

fn options(arguments: &DiffArguments) -> Result<Options> {
    let mut options = Options {
        key: arguments.key.clone(),
        ignore: arguments.ignore.iter().cloned().collect(),
        by_occurrence: arguments.occurrence,
        reread: arguments.reread,
        limit: usize::from(arguments.limit),
        out: arguments.out.clone(),
        ..Options::default()
    };
    arguments.atol.iter().try_for_each(|text| options.atol.add("--atol", text))?;
    arguments.rtol.iter().try_for_each(|text| options.rtol.add("--rtol", text))?;
    for text in &arguments.quaternion {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_string()).collect();
        if names.len() != 4 {
            return Err(Error::spec("--quaternion", format!("`{text}`: expected four columns w,x,y,z")));
        }
        options.quaternions.push(names);
    }
    Ok(options)
}

fn json(diff: &TableDiff) -> Result<serde_json::Value> {
    let mut value = serde_json::to_value(diff).map_err(|error| Error::Bug(error.to_string()))?;
    value["same"] = diff.is_same().into();
    Ok(value)
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|error| Error::spec(path.display().to_string(), format!("cannot write: {error}")))
}
