//! Two runs compared: settings, files and seeds that differ, then every table that both have.

use crate::diff::{DiffOptions, TableDiff, compare};
use crate::error::{Error, Result, did_you_mean, suggestion};
use crate::pipeline::{KeyChange, Manifest, OutputRecord, changes_of};
use crate::raw::parquet;
use crate::store::schema::{self, ColumnType, TableSchema};
use crate::store::{Store, TableRef};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Two runs compared.
#[derive(Debug, Clone, Serialize)]
pub struct RunDiff {
    pub(crate) a: RunSummary,
    pub(crate) b: RunSummary,
    /// What was put in: settings, files, seeds, implementations. What follows from these is no cause.
    pub(crate) causes: Vec<SettingChange>,
    /// Tables of both, in the order of the pipeline.
    pub(crate) tables: Vec<TableChange>,
}

/// A run in a line.
#[derive(Debug, Clone, Serialize)]
pub struct RunSummary {
    pub(crate) run: String,
    pub(crate) pipeline: String,
    /// RFC 3339, UTC.
    pub(crate) started: String,
    pub(crate) version: String,
}

/// A setting that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SettingChange {
    pub(crate) stage: String,
    /// Before and now.
    #[serde(flatten)]
    pub(crate) change: KeyChange,
}

/// A table of one or both runs.
#[derive(Debug, Clone, Serialize)]
pub struct TableChange {
    /// `stage.port`.
    pub(crate) name: String,
    /// The name of its schema.
    pub(crate) kind: String,
    /// How it differs, in words.
    pub(crate) status: &'static str,
    /// Where both have it, their content differs, and both are still in the store.
    pub(crate) diff: Option<TableDiff>,
}

impl RunDiff {
    /// Whether neither settings nor tables differ.
    pub(crate) fn is_same(&self) -> bool {
        self.tables.iter().all(|table| {
            table.status == "same" || table.diff.as_ref().is_some_and(TableDiff::is_same)
        })
    }
}

/// Compares run `a` with run `b`: all stages or one, all its ports or one. Tolerances and columns that are left out hold in every table
/// that has the column; fails where no table that both have does.
pub fn compare_runs(
    store: &Store,
    a: &RunAddress,
    b: &RunAddress,
    options: &DiffOptions,
) -> Result<RunDiff> {
    let (left, right) = (Manifest::of(store, &a.run)?, Manifest::of(store, &b.run)?);
    let (outputs_a, outputs_b) = (outputs(&left, a), outputs(&right, b));
    let names: BTreeSet<&String> = outputs_a
        .iter()
        .chain(&outputs_b)
        .map(|(name, _)| name)
        .collect();
    // In the order of the pipeline, what only A has last.
    let mut order: Vec<&String> = outputs_b.iter().map(|(name, _)| name).collect();
    order.extend(
        names
            .into_iter()
            .filter(|name| !outputs_b.iter().any(|(other, _)| other == *name)),
    );
    let common = outputs_b
        .iter()
        .filter(|(name, _)| outputs_a.iter().any(|(other, _)| other == name));
    known_columns(
        &common.map(|(_, output)| output.kind.as_str()).collect(),
        options,
    )?;
    let options = &DiffOptions {
        where_present: true,
        ..options.clone()
    };
    let mut tables = Vec::new();
    for name in order {
        let record = |outputs: &[(String, OutputRecord)]| {
            outputs
                .iter()
                .find(|(other, _)| other == name)
                .map(|(_, output)| output.clone())
        };
        tables.push(table(
            store,
            name,
            record(&outputs_a),
            record(&outputs_b),
            options,
        )?);
    }
    Ok(RunDiff {
        a: summary_of(&left),
        b: summary_of(&right),
        causes: causes(&left, &right),
        tables,
    })
}

/// Columns in the options must be those of some of these kinds of tables.
fn known_columns(kinds: &BTreeSet<&str>, options: &DiffOptions) -> Result<()> {
    let schemas: Vec<&TableSchema> = schema::all()
        .filter(|schema| kinds.contains(schema.name.as_str()))
        .collect();
    let wishes = [
        ("--ignore", options.ignore.iter().collect::<Vec<_>>()),
        ("--atol", options.atol.columns.keys().collect()),
        ("--rtol", options.rtol.columns.keys().collect()),
    ];
    for (flag, names) in wishes {
        let unknown = names
            .into_iter()
            .find(|name| schemas.iter().all(|schema| schema.field_of(name).is_none()));
        if let Some(name) = unknown {
            let columns = schemas
                .iter()
                .flat_map(|schema| &schema.fields)
                .map(|field| field.name.as_str());
            let hint = did_you_mean(name, columns);
            let message = format!("no column `{name}` in any table that both runs have{hint}");
            return Err(Error::spec(flag, message));
        }
    }
    Ok(())
}

/// A run, or one stage of it, or one of its tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunAddress {
    /// As `calib log` names it.
    pub(crate) run: String,
    pub(crate) stage: Option<String>,
    pub(crate) port: Option<String>,
}

fn summary_of(manifest: &Manifest) -> RunSummary {
    RunSummary {
        run: manifest.run_id.clone(),
        pipeline: manifest.pipeline.name.clone(),
        started: manifest.started.clone(),
        version: manifest.tool.version.clone(),
    }
}

fn outputs(manifest: &Manifest, place: &RunAddress) -> Vec<(String, OutputRecord)> {
    let stages = manifest
        .stages
        .iter()
        .filter(|stage| place.stage.as_ref().is_none_or(|id| id == &stage.id));
    let named = stages.flat_map(|stage| stage.outputs.iter().map(move |output| (stage, output)));
    let wanted =
        named.filter(|(_, output)| place.port.as_ref().is_none_or(|port| port == &output.port));
    wanted
        .map(|(stage, output)| (format!("{}.{}", stage.id, output.port), output.clone()))
        .collect()
}

fn causes(a: &Manifest, b: &Manifest) -> Vec<SettingChange> {
    let cause = |stage: &str, what, before: &str, now: &str| SettingChange {
        stage: stage.into(),
        change: KeyChange {
            what,
            name: stage.into(),
            before: before.into(),
            now: now.into(),
        },
    };
    let mut causes = Vec::new();
    if a.tool.version != b.tool.version {
        causes.push(cause("", "calib", &a.tool.version, &b.tool.version));
    }
    for stage in &b.stages {
        let Some(before) = a.stage(&stage.id) else {
            causes.push(cause(&stage.id, "stage", "-", &stage.uses));
            continue;
        };
        let keys = before.key.as_ref().zip(stage.key.as_ref());
        let changes = keys.map_or_else(Vec::new, |(old, new)| changes_of(old, new));
        let others = changes.into_iter().filter(|change| change.what != "input");
        causes.extend(others.map(|change| SettingChange {
            stage: stage.id.clone(),
            change,
        }));
    }
    let gone = a.stages.iter().filter(|stage| b.stage(&stage.id).is_none());
    causes.extend(gone.map(|stage| cause(&stage.id, "stage", &stage.uses, "-")));
    causes
}

fn table(
    store: &Store,
    name: &str,
    a: Option<OutputRecord>,
    b: Option<OutputRecord>,
    options: &DiffOptions,
) -> Result<TableChange> {
    let kind = b
        .as_ref()
        .or(a.as_ref())
        .map(|output| output.kind.clone())
        .unwrap_or_default();
    let change = |status: &'static str, diff: Option<TableDiff>| TableChange {
        name: name.into(),
        kind: kind.clone(),
        status,
        diff,
    };
    let (Some(a), Some(b)) = (&a, &b) else {
        return Ok(change(
            if a.is_some() {
                "only in A"
            } else {
                "only in B"
            },
            None,
        ));
    };
    if a.table.table_hash == b.table.table_hash && !options.reread {
        return Ok(change("same", None));
    }
    let paths = [store.object(&a.table)?, store.object(&b.table)?];
    if paths.iter().any(|path| !path.exists()) {
        return Ok(change("changed, but no longer in the store", None));
    }
    let diff = compare(&paths[0], &paths[1], options)?;
    Ok(change(
        if diff.is_same() {
            "within tolerance"
        } else {
            "changed"
        },
        Some(diff),
    ))
}

/// The tables of one run, in the order of its pipeline.
#[derive(Debug, Clone)]
pub struct QueryTables {
    run: String,
    tables: Vec<QueryTable>,
}

/// A table that can be asked.
#[derive(Debug, Clone)]
pub struct QueryTable {
    /// `stage_port`, a dash written as an underscore.
    pub(crate) name: String,
    /// Its kind, where no other stage of the run writes such a table.
    pub(crate) short: Option<String>,
    /// Id of the stage that wrote it.
    pub(crate) stage: String,
    /// On which it was written.
    pub(crate) port: String,
    /// The name of its schema.
    pub(crate) kind: String,
    /// Where it is.
    pub table: TableRef,
}

/// A column that can be asked, as the table's file has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QueryColumn {
    pub(crate) name: String,
    /// As the schema states it.
    #[serde(rename = "type")]
    pub(crate) column_type: String,
    /// Unit of its numbers, where the schema states one.
    pub(crate) unit: Option<String>,
    pub(crate) description: String,
}

impl QueryTables {
    /// The tables that a run wrote or took.
    pub fn of(manifest: &Manifest) -> Self {
        let outputs = || {
            manifest
                .stages
                .iter()
                .flat_map(|stage| stage.outputs.iter().map(move |output| (&stage.id, output)))
        };
        let alone = |kind: &str| outputs().filter(|(_, output)| output.kind == kind).count() == 1;
        let table = |(stage, output): (&String, &crate::pipeline::OutputRecord)| QueryTable {
            name: format!("{stage}_{}", output.port).replace('-', "_"),
            short: alone(&output.kind).then(|| output.kind.clone()),
            stage: stage.clone(),
            port: output.port.clone(),
            kind: output.kind.clone(),
            table: output.table.clone(),
        };
        Self {
            run: manifest.run_id.clone(),
            tables: outputs().map(table).collect(),
        }
    }

    /// In the order of the pipeline.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &QueryTable> {
        self.tables.iter()
    }

    /// The table of a name: `stage_port`, `stage/port`, `stage.port`, or the kind where one stage alone writes it.
    pub fn find(&self, name: &str) -> Result<&QueryTable> {
        let exact: Vec<&QueryTable> = self.iter().filter(|table| table.is_called(name)).collect();
        let (found, what) = match exact.is_empty() {
            false => (exact, "is the name of several tables"),
            true => (
                self.iter().filter(|table| table.kind == name).collect(),
                "is written by several stages",
            ),
        };
        match found[..] {
            [table] => Ok(table),
            [] => Err(self.unknown(name)),
            _ => {
                let names: Vec<String> = found
                    .iter()
                    .map(|table| format!("{}.{}", table.stage, table.port))
                    .collect();
                Err(Error::spec(
                    "SQL",
                    format!("`{name}` {what}; say which: {}", names.join(", ")),
                ))
            }
        }
    }

    fn unknown(&self, name: &str) -> Error {
        let spelled = name.replace(['.', '/', '-'], "_");
        let names: Vec<&str> = self
            .iter()
            .flat_map(|table| [Some(table.name.as_str()), table.short.as_deref()])
            .flatten()
            .collect();
        let hint = suggestion(&spelled, names.iter().copied());
        let known: Vec<&str> = self.iter().map(|table| table.name.as_str()).collect();
        Error::spec(
            "SQL",
            format!(
                "run {} has no table `{name}`{hint} Its tables: {}",
                self.run,
                known.join(", ")
            ),
        )
    }
}

impl QueryTable {
    fn is_called(&self, name: &str) -> bool {
        let separated = |separator: char| {
            name.split_once(separator) == Some((self.stage.as_str(), self.port.as_str()))
        };
        name == self.name || ['.', '/', '_'].into_iter().any(separated)
    }

    /// What the kind of table is for; nothing of a kind that this calib does not know.
    pub(crate) fn schema(&self) -> Option<&'static TableSchema> {
        schema::all().find(|schema| schema.name == self.kind)
    }

    /// The columns that its file has.
    pub fn columns(&self, store: &Store) -> Result<Vec<QueryColumn>> {
        let path = self.file(store)?;
        let file = File::open(&path)
            .map_err(|error| error.to_string())
            .and_then(|file| parquet(file, 1));
        let file = file.map_err(|error| self.fault(&path, format!("cannot be read: {error}")))?;
        Ok(file
            .schema
            .fields()
            .iter()
            .map(|field| self.column(field.name().clone()))
            .collect())
    }

    /// Where its file is; of a store in a bucket it is fetched first. Fails where it has left the store.
    pub(super) fn file(&self, store: &Store) -> Result<PathBuf> {
        let path = store.object(&self.table)?;
        match path.is_file() {
            true => Ok(path),
            false => Err(self.fault(
                &path,
                "its file is no longer in the store; run the pipeline again to make it again",
            )),
        }
    }

    /// What is wrong with its file.
    pub(super) fn fault(&self, path: &Path, why: impl std::fmt::Display) -> Error {
        Error::store(
            path.display().to_string(),
            format!("table {}: {why}", self.name),
        )
    }

    fn column(&self, name: String) -> QueryColumn {
        let Some((field, joint)) = self.schema().and_then(|schema| schema.field_of(&name)) else {
            return QueryColumn {
                name,
                column_type: String::new(),
                unit: None,
                description: String::new(),
            };
        };
        let joint = joint.map_or_else(String::new, |joint| joint.to_string());
        let column_type = match field.column_type {
            ColumnType::Utf8 => "utf8",
            ColumnType::Int64 => "int64",
            ColumnType::Float64 => "float64",
            ColumnType::Boolean => "boolean",
        };
        let description = field.description.replace("{j}", &joint);
        QueryColumn {
            name,
            column_type: column_type.into(),
            unit: field.unit.clone(),
            description,
        }
    }
}
