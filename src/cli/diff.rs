//! `calib diff`: two tables or two runs compared; exit code 0 same, 1 different beyond tolerance, 2 could not compare.

use super::surroundings::open_store;
use super::{complain, emit, emit_json, write};
use crate::audit::{RunAddress, compare_runs};
use crate::diff::{self, Detail, DiffOptions, TableDiff};
use crate::error::{Error, Result};
use crate::identified::counted_otherwise;
use crate::pipeline::{Manifest, find_run};
use crate::store::{Store, TableRef};
use crate::summary::{rival_changes, run_diff};
use crate::table::{Recording, Table};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Compare two tables or two runs: which rows changed, by how much, in the column's unit and in sigmas.
///
/// Keys, tolerances and what is an angle come from the tables' schema. Rows are the same, within tolerance, changed, in one
/// table only, or have a key that is not theirs alone. Of two runs every table is compared; tolerances that are given and columns that are
/// left out hold in each table that has the column. Of runs with a diagnosis it is said which rivals of a finding B decided.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct DiffArguments {
    /// A Parquet file, or a run: RUN, RUN/STAGE or RUN/STAGE/PORT, RUN being an id, a tag, HEAD or HEAD~1
    a: String,
    /// The same, to compare with
    b: String,
    /// Columns that identify rows, instead of those of the schema; for two tables, not for runs
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
    /// Four columns that are one rotation; those called qw, qx, qy, qz are known; for two tables, not for runs
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
    /// Writes every cell that differs as a row of a Parquet file; for two tables, not for runs
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Where runs are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Ends with code 0 also where there are differences
    #[arg(long)]
    exit_zero: bool,
}

const EXAMPLES: &str = "Examples:
  calib diff monday.parquet tuesday.parquet
  calib diff HEAD~1 HEAD
  calib diff HEAD~1 HEAD --atol 0.001 --ignore remark
  calib diff released/joint/parameters HEAD/joint/parameters
  calib diff a.parquet b.parquet --key robot,pose --atol x_mm=50um --ignore remark
  calib diff a.parquet b.parquet --stat --out cells.parquet

Exit codes: 0 same; 1 different beyond tolerance; 2 could not compare, or keys that occur twice.";

impl DiffArguments {
    pub(crate) fn run(&self) -> Result<u8> {
        match execute(self) {
            Err(error) if !matches!(error, Error::Bug(_)) => {
                complain(&error);
                Ok(2)
            }
            other => other,
        }
    }
}

fn execute(arguments: &DiffArguments) -> Result<u8> {
    let options = options(arguments)?;
    let (a, b) = (Path::new(&arguments.a), Path::new(&arguments.b));
    if a.is_file()
        || b.is_file()
        || arguments.a.ends_with(".parquet")
        || arguments.b.ends_with(".parquet")
    {
        return tables(arguments, a, b, &options, None);
    }
    let store = open_store(arguments.store.as_deref())?;
    let (a, b) = (place(&store, &arguments.a)?, place(&store, &arguments.b)?);
    let counting = counting(&store, [&a, &b])?;
    if let (Some(left), Some(right)) = (output(&store, &a)?, output(&store, &b)?) {
        let counting = counting.filter(|_| {
            [&left, &right]
                .iter()
                .any(|table| table.schema.split('/').next() == Some(Recording::KIND))
        });
        return tables(
            arguments,
            &store.object(&left)?,
            &store.object(&right)?,
            &options,
            counting,
        );
    }
    let for_tables = [
        ("--key", !options.key.is_empty()),
        ("--quaternion", !options.quaternions.is_empty()),
        ("--out", options.out.is_some()),
    ];
    if let Some((flag, _)) = for_tables.into_iter().find(|(_, given)| *given) {
        return Err(Error::spec(
            flag,
            "is for two tables: name them as RUN/STAGE/PORT",
        ));
    }
    let diff = compare_runs(&store, &a, &b, &options)?;
    let rivals = rival_changes(&store, &diff, [&a, &b])?;
    if arguments.json {
        let mut value = json!(diff);
        value["same"] = diff.is_same().into();
        value["counting"] = counting.into();
        value["rivals"] = json!(rivals);
        emit_json(&value)?;
    } else {
        emit(&(run_diff(&diff, &rivals, arguments.stat) + &line(counting.as_deref())))?;
    }
    let tables = diff.tables.iter();
    let tables = tables.filter_map(|table| Some((table.name.clone(), table.diff.clone()?)));
    let tables: Vec<(String, TableDiff)> = tables.collect();
    if let Some(path) = &arguments.html {
        let text = run_diff(&diff, &rivals, true);
        let notes = text.lines().filter(|line| !line.is_empty());
        let notes: Vec<String> = notes.map(String::from).collect();
        let title = format!("runs {} and {}", diff.a.run, diff.b.run);
        write(path, &diff::html(&title, &notes, &tables)?)?;
    }
    let duplicates = tables.iter().map(|(_, diff)| diff.duplicates()).sum();
    Ok(code(diff.is_same(), duplicates, arguments))
}

/// In which counting the joints of two runs' tables stand; none where both controllers count as the robot file does.
fn counting(store: &Store, runs: [&RunAddress; 2]) -> Result<Option<String>> {
    // Runs are compared by what is left of them, too.
    let of_run = |run: &RunAddress| -> Result<Option<String>> {
        Ok(counted_otherwise(&Manifest::of(store, &run.run)?, store).unwrap_or_default())
    };
    let controllers = match (of_run(runs[0])?, of_run(runs[1])?) {
        (None, None) => return Ok(None),
        (Some(a), Some(b)) if a == b => format!("both controllers count otherwise ({a})"),
        (Some(a), None) => format!("the controller of A counts otherwise ({a})"),
        (None, Some(b)) => format!("the controller of B counts otherwise ({b})"),
        (Some(a), Some(b)) => format!("the controllers count otherwise (A: {a}; B: {b})"),
    };
    Ok(Some(format!(
        "joints stand in the robot file's counting; {controllers}"
    )))
}

fn line(sentence: Option<&str>) -> String {
    sentence
        .map(|sentence| format!("{sentence}\n"))
        .unwrap_or_default()
}

fn tables(
    arguments: &DiffArguments,
    a: &Path,
    b: &Path,
    options: &DiffOptions,
    counting: Option<String>,
) -> Result<u8> {
    let diff = diff::compare(a, b, options)?;
    if arguments.json {
        let mut value = json!(diff);
        value["same"] = diff.is_same().into();
        value["counting"] = counting.into();
        emit_json(&value)?;
    } else {
        let detail = if arguments.stat {
            Detail::Stat
        } else {
            Detail::Full
        };
        emit(&(diff::text(&diff, detail) + &line(counting.as_deref())))?;
    }
    let code = code(diff.is_same(), diff.duplicates(), arguments);
    if let Some(path) = &arguments.html {
        write(
            path,
            &diff::html("calib diff", &[], &[("tables".into(), diff)])?,
        )?;
    }
    Ok(code)
}

fn code(same: bool, duplicates: u64, arguments: &DiffArguments) -> u8 {
    match (duplicates, same || arguments.exit_zero) {
        (1.., _) => 2,
        (0, true) => 0,
        (0, false) => 1,
    }
}

/// `RUN`, `RUN/STAGE`, `RUN/STAGE/PORT`.
fn place(store: &Store, text: &str) -> Result<RunAddress> {
    let mut parts = text.split('/').map(String::from);
    let run = find_run(store, &parts.next().unwrap_or_default())?;
    let place = RunAddress {
        run,
        stage: parts.next(),
        port: parts.next(),
    };
    if parts.next().is_some() {
        return Err(Error::spec(
            text,
            "expected a Parquet file, RUN, RUN/STAGE or RUN/STAGE/PORT",
        ));
    }
    let manifest = Manifest::of(store, &place.run)?;
    if let Some(id) = &place.stage {
        let stages = manifest.stages.iter().map(|stage| stage.id.as_str());
        let stages: Vec<&str> = stages.collect();
        let unknown = || format!("no stage `{id}`; its stages: {}", stages.join(", "));
        let stage = manifest.stage(id);
        let stage = stage.ok_or_else(|| Error::spec(text, unknown()))?;
        let ports = stage.outputs.iter().map(|output| output.port.as_str());
        let ports: Vec<&str> = ports.collect();
        if let Some(port) = place.port.as_deref().filter(|port| !ports.contains(port)) {
            let ports = ports.join(", ");
            let message = format!("stage {id} has no table `{port}`; its tables: {ports}");
            return Err(Error::spec(text, message));
        }
    }
    Ok(place)
}

/// The table of a place that names one.
fn output(store: &Store, place: &RunAddress) -> Result<Option<TableRef>> {
    let (Some(stage), Some(port)) = (&place.stage, &place.port) else {
        return Ok(None);
    };
    let manifest = Manifest::of(store, &place.run)?;
    let output = manifest
        .stage(stage)
        .and_then(|stage| stage.outputs.iter().find(|output| &output.port == port));
    Ok(output.map(|output| output.table.clone()))
}

fn options(arguments: &DiffArguments) -> Result<DiffOptions> {
    let mut options = DiffOptions {
        key: arguments.key.clone(),
        ignore: arguments.ignore.iter().cloned().collect(),
        by_occurrence: arguments.occurrence,
        reread: arguments.reread,
        limit: usize::from(arguments.limit),
        out: arguments.out.clone(),
        ..DiffOptions::default()
    };
    for text in &arguments.atol {
        options.atol.add("--atol", text)?;
    }
    for text in &arguments.rtol {
        options.rtol.add("--rtol", text)?;
    }
    for text in &arguments.quaternion {
        let names = text.split(',').map(|name| name.trim().to_string());
        let names: Vec<String> = names.collect();
        if names.len() != 4 {
            let message = format!("`{text}`: expected four columns w,x,y,z");
            return Err(Error::spec("--quaternion", message));
        }
        options.quaternions.push(names);
    }
    Ok(options)
}
