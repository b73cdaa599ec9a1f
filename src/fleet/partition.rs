//! One big recording table, parted by robot into files below the store; a table that was parted before is not parted again.

use super::list::{delimiter, is_parquet};
use super::robot::FleetRobot;
use crate::error::{Error, Result};
use crate::raw;
use crate::store::{FileHash, Store};
use arrow::array::{Array, RecordBatch, UInt32Array};
use arrow::compute::{concat_batches, take_record_batch};
use arrow::util::display::array_value_to_string;
use parquet::arrow::ArrowWriter;
use std::collections::BTreeMap;
use std::path::Path;

/// Rows read at a time.
const BATCH: usize = 1 << 10;

/// Parts the table at `path` by its column `by`; `variable` takes the file of a robot.
pub(super) fn read(
    path: &Path,
    by: &str,
    variable: &str,
    fleet: &str,
    store: &Store,
) -> Result<Vec<FleetRobot>> {
    let fault = |error: String| Error::spec("recording", format!("`{}`: {error}", path.display()));
    let hash = raw::open(path)
        .and_then(FileHash::of_reader)
        .map_err(|error| fault(error.to_string()))?;
    let source = blake3::hash(format!("{hash} {by}").as_bytes()).to_hex()[..16].to_string();
    let place = ["fleets", fleet, "parts", &source];
    let names: Vec<String> = match store.note(&place, "names.json")? {
        Some(value) => serde_json::from_value(value).map_err(|error| fault(error.to_string()))?,
        None => {
            let parts = if is_parquet(path) {
                parquet(path, by)
            } else {
                csv(path, by)
            }
            .map_err(fault)?;
            for (name, bytes) in &parts {
                store.put_file(&place, &file_name(name, path), bytes)?;
            }
            // The names say that all parts are there.
            store.sync()?;
            let names: Vec<String> = parts.into_keys().collect();
            store.put_note(&place, "names.json", &names)?;
            names
        }
    };
    if names.is_empty() {
        return Err(fault("it has no rows".into()));
    }
    let folder = place
        .iter()
        .fold(store.root().to_path_buf(), |folder, part| folder.join(part));
    let robot = |name: String| {
        let file = folder
            .join(file_name(&name, path))
            .to_string_lossy()
            .into_owned();
        let mut robot = FleetRobot::new(name);
        robot.set_text(variable, &file);
        robot
    };
    Ok(names.into_iter().map(robot).collect())
}

fn file_name(name: &str, path: &Path) -> String {
    let ending = if is_parquet(path) { "parquet" } else { "csv" };
    format!("{}.{ending}", &blake3::hash(name.as_bytes()).to_hex()[..24])
}

/// Name -> bytes of a file.
type Parts = BTreeMap<String, Vec<u8>>;

fn csv(path: &Path, by: &str) -> Result<Parts, String> {
    let delimiter = delimiter(path, "recording").map_err(|error| error.to_string())?;
    let file = raw::open(path).map_err(|error| error.to_string())?;
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .from_reader(file);
    let header = reader
        .byte_headers()
        .map_err(|error| error.to_string())?
        .clone();
    let position = header
        .iter()
        .position(|name| name == by.as_bytes())
        .ok_or_else(|| format!("it has no column `{by}`"))?;
    let mut writers: BTreeMap<String, csv::Writer<Vec<u8>>> = BTreeMap::new();
    for record in reader.byte_records() {
        let record = record.map_err(|error| error.to_string())?;
        let name = String::from_utf8_lossy(record.get(position).unwrap_or_default()).into_owned();
        if !writers.contains_key(&name) {
            let mut writer = csv::Writer::from_writer(Vec::new());
            writer
                .write_byte_record(&header)
                .map_err(|error| error.to_string())?;
            writers.insert(name.clone(), writer);
        }
        let Some(writer) = writers.get_mut(&name) else {
            continue;
        };
        writer
            .write_byte_record(&record)
            .map_err(|error| error.to_string())?;
    }
    writers
        .into_iter()
        .map(|(name, writer)| {
            Ok((
                name,
                writer.into_inner().map_err(|error| error.to_string())?,
            ))
        })
        .collect()
}

fn parquet(path: &Path, by: &str) -> Result<Parts, String> {
    let file = raw::open(path).map_err(|error| error.to_string())?;
    let mut parts: BTreeMap<String, Vec<RecordBatch>> = BTreeMap::new();
    for batch in raw::parquet(file, BATCH)? {
        let batch = batch?;
        let column = batch
            .column_by_name(by)
            .ok_or_else(|| format!("it has no column `{by}`"))?;
        let mut rows: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for row in 0..column.len() {
            let name = array_value_to_string(column, row).map_err(|error| error.to_string())?;
            rows.entry(name)
                .or_default()
                .push(u32::try_from(row).map_err(|error| error.to_string())?);
        }
        for (name, rows) in rows {
            let part = take_record_batch(&batch, &UInt32Array::from(rows))
                .map_err(|error| error.to_string())?;
            parts.entry(name).or_default().push(part);
        }
    }
    let written = |(name, batches): (String, Vec<RecordBatch>)| {
        let schema = batches[0].schema();
        let whole = concat_batches(&schema, &batches).map_err(|error| error.to_string())?;
        let mut writer =
            ArrowWriter::try_new(Vec::new(), schema, None).map_err(|error| error.to_string())?;
        writer.write(&whole).map_err(|error| error.to_string())?;
        Ok((
            name,
            writer.into_inner().map_err(|error| error.to_string())?,
        ))
    };
    parts.into_iter().map(written).collect()
}
