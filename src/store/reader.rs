//! Parquet files back to frames: the file's hash first, then schema and version, then the columns.

use arrow::array::ArrayRef;
use arrow::compute::concat_batches;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::{self, File};
use std::path::Path;

use super::actions::TableRef;
use super::disk::refused;
use super::frame::{Frame, FrameBuilder};
use super::key::FileHash;
use super::schema::{self, Version};
use crate::error::{Error, Result};

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
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| unreadable(&e))?;
    let arrow_schema = builder.schema().clone();
    let reader = builder.with_batch_size(1 << 16).build().map_err(|e| unreadable(&e))?;
    let batches = reader.collect::<Result<Vec<_>, _>>().map_err(|e| unreadable(&e))?;
    let batch = concat_batches(&arrow_schema, &batches).map_err(|e| unreadable(&e))?;
    let mut frame = FrameBuilder::new(kind);
    for (field, column) in arrow_schema.fields().iter().zip(batch.columns()) {
        frame.push(field.name(), column.clone());
    }
    for (name, column) in added_since(kind, version, &batch)? {
        frame.push(name, column);
    }
    frame.finish()
}

/// Nullable columns that a later minor version has, as nulls.
fn added_since(kind: &str, version: Version, batch: &arrow::array::RecordBatch) -> Result<Vec<(String, ArrayRef)>> {
    let schema = schema::of(kind)?;
    if version.minor == schema.version.minor {
        return Ok(Vec::new());
    }
    let added = schema
        .fields
        .iter()
        .filter(|field| field.nullable && !field.optional && !field.per_joint && batch.column_by_name(&field.name).is_none());
    Ok(added
        .map(|field| (field.name.clone(), arrow::array::new_null_array(&field.column_type.arrow(), batch.num_rows())))
        .collect())
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
