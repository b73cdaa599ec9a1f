//! Parquet files back to frames: the file's hash first, then schema and version, then the columns.

use arrow::array::ArrayRef;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;

use super::disk::refused;
use super::frame::{Frame, FrameBuilder};
use super::key::FileHash;
use super::schema::{self, Version};
use super::table_ref::TableRef;
use crate::error::{Error, Fault, Result};
use crate::raw;

/// The columns of a table, by name.
type Columns = BTreeMap<String, ArrayRef>;

/// Reads a published table; a damaged file is set aside, so that the next run makes it anew.
pub(super) fn load(path: &Path, table: &TableRef) -> Result<Frame> {
    let (kind, version) = known_schema(path, &table.schema)?;
    let file = File::open(path).map_err(|e| refused(path, "read", &e))?;
    let found = FileHash::of_reader(&file).map_err(|e| refused(path, "read", &e))?;
    if found != table.file_hash {
        return Err(set_aside(path, "its bytes are not those that were published"));
    }
    let frame = read(path, kind, version)?;
    if frame.rows() as u64 != table.rows {
        return Err(set_aside(path, "it has another number of rows than was published"));
    }
    Ok(frame)
}

/// The kind of a schema id `name/version` that this calib can read.
fn known_schema<'a>(path: &Path, id: &'a str) -> Result<(&'a str, Version)> {
    let place = path.display().to_string();
    let parts = id.split_once('/').and_then(|(kind, version)| Some((kind, Version::parse(version)?)));
    let Some((kind, version)) = parts else {
        return Err(Error::store(place, format!("schema `{id}` is not of the form name/1.0.0")));
    };
    let known = schema::all().find(|schema| schema.name == kind).map(|schema| schema.version);
    match known {
        Some(known) if known.major == version.major && version.minor <= known.minor => Ok((kind, version)),
        Some(known) => Err(Error::store(
            place,
            format!("the table is {id}, this calib reads {kind}/{known}: use the calib that wrote it, or a newer one"),
        )),
        None => {
            Err(Error::store(place, format!("this calib knows no table `{kind}`: use the calib that wrote it, or a newer one")))
        }
    }
}

fn read(path: &Path, kind: &str, version: Version) -> Result<Frame> {
    let unreadable =
        |e: &dyn std::fmt::Display| Error::store(path.display().to_string(), format!("not a readable Parquet file: {e}"));
    let file = File::open(path).map_err(|e| refused(path, "read", &e))?;
    let batch = raw::parquet(file, 1 << 16).and_then(raw::ParquetFile::whole).map_err(|e| unreadable(&e))?;
    let names = batch.schema_ref().fields().iter().map(|field| field.name().clone());
    let columns: Columns = names.zip(batch.columns().iter().cloned()).collect();
    let mut frame = FrameBuilder::new(kind);
    let added = added_since(kind, version, &columns, batch.num_rows())?;
    for (name, column) in columns.into_iter().chain(added) {
        frame.push(name, column);
    }
    frame.finish()
}

/// Reads a table that is not in a store, of the kind that it names or of the one that is given.
pub fn read_table(path: &Path, kind: Option<&str>) -> Result<Frame> {
    let place = path.display().to_string();
    let unreadable = |e: &dyn std::fmt::Display| Error::data(&place, format!("not a readable Parquet file: {e}"));
    let file = raw::open(path).map_err(|e| Error::spec(&place, format!("cannot be read: {e}")))?;
    let builder = raw::decoded(|| ParquetRecordBatchReaderBuilder::try_new(file)).map_err(|e| unreadable(&e))?;
    let builder = builder.map_err(|e| unreadable(&e))?;
    let said = builder.metadata().file_metadata().key_value_metadata().into_iter().flatten();
    let id = said.filter(|pair| pair.key == "calib.schema").find_map(|pair| pair.value.clone());
    let (kind, version) = match (kind, &id) {
        (None, Some(id)) => known_schema(path, id)?,
        (Some(kind), _) => (kind, schema::of(kind)?.version),
        (None, None) => return Err(Error::spec(place, "does not say which table it is; say so with --as KIND")),
    };
    read(path, kind, version).map_err(|error| match error {
        Error::Bug(message) => Error::data(&place, message),
        // It is no object of a store, which a later try could mend.
        Error::Store(fault) => Error::Data(vec![fault]),
        Error::Data(faults) => {
            Error::Data(faults.into_iter().map(|fault| Fault::new(format!("{place}: {}", fault.place), fault.message)).collect())
        }
        other => other,
    })
}

/// Nullable columns that a later minor version has, as nulls.
fn added_since(kind: &str, version: Version, columns: &Columns, rows: usize) -> Result<Columns> {
    let schema = schema::of(kind)?;
    if version.minor == schema.version.minor {
        return Ok(Columns::new());
    }
    let added = schema
        .fields
        .iter()
        .filter(|field| field.nullable && !field.optional && !field.per_joint && !columns.contains_key(&field.name));
    Ok(added.map(|field| (field.name.clone(), arrow::array::new_null_array(&field.column_type.arrow(), rows))).collect())
}

/// Takes a damaged object out of the way.
fn set_aside(path: &Path, why: &str) -> Error {
    let place = path.display().to_string();
    match fs::rename(path, path.with_extension("damaged")) {
        Ok(()) => {
            Error::store(place, format!("damaged: {why}; it was set aside, run again and the stage that made it makes it anew"))
        }
        Err(e) => Error::store(place, format!("damaged: {why}; delete it and run again ({e})")),
    }
}
