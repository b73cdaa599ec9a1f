//! The tables of a run, by the names that SQL knows them by, with their columns.

use serde::Serialize;
use std::fs::File;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result, suggestion};
use crate::pipeline::Manifest;
use crate::raw::parquet;
use crate::store::schema::{self, ColumnType, TableSchema};
use crate::store::{Store, TableRef};

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
    /// As SQL knows it.
    pub(crate) name: String,
    /// As the schema states it.
    #[serde(rename = "type")]
    pub(crate) column_type: String,
    /// Unit of its numbers, where the schema states one.
    pub(crate) unit: Option<String>,
    /// What it means.
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
