//! Robots from a list: a table of any kind, one row a robot.

use super::file::FleetRobot;
use crate::error::{Error, Fault, Result, instead};
use crate::pipeline::Override;
use crate::raw::{self, Delimiter, Record, TextLayout};
use crate::stage::ingest::{TableLayout, records};
use crate::store::{FileHash, Store};
use arrow::array::{Array, RecordBatch, UInt32Array};
use arrow::compute::{concat_batches, take_record_batch};
use arrow::util::display::array_value_to_string;
use parquet::arrow::ArrowWriter;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Columns that a list may have in addition to `set.TARGET` and `path.TARGET`.
const COLUMNS: [&str; 5] = ["robot", "folder", "model", "plant", "campaign"];

/// Reads a list; `variable` takes the folder. Fails with every fault of its columns and rows.
pub(super) fn read_list(path: &Path, variable: &str) -> Result<Vec<FleetRobot>> {
    let (columns, rows) = cells(path)?;
    let shown = path.display();
    let mut faults = Vec::new();
    for column in &columns {
        if !COLUMNS.contains(&column.as_str())
            && !column.starts_with("set.")
            && !column.starts_with("path.")
        {
            let message = format!(
                "`{shown}` has a column {column:?}{}, set.TARGET, path.TARGET",
                instead(column, &COLUMNS)
            );
            faults.push(Fault::new("list", message));
        }
    }
    if !columns.iter().any(|column| column == "robot") {
        faults.push(Fault::new(
            "list",
            format!("`{shown}` has no column `robot`"),
        ));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut robots = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let mut robot = FleetRobot::new(String::new());
        for (column, cell) in columns.iter().zip(row).filter(|(_, cell)| !cell.is_empty()) {
            let below = || folder.join(cell).to_string_lossy().into_owned();
            match column.as_str() {
                "robot" => robot.name.clone_from(cell),
                "folder" => robot.set_text(variable, &below()),
                "model" => robot.groups.model = Some(cell.clone()),
                "plant" => robot.groups.plant = Some(cell.clone()),
                "campaign" => robot.groups.campaign = Some(cell.clone()),
                other => match (other.strip_prefix("set."), other.strip_prefix("path.")) {
                    (Some(target), _) => robot.sets.push(Override {
                        target: target.into(),
                        value: cell.clone(),
                    }),
                    (_, Some(target)) => robot.set_text(target, &below()),
                    _ => (),
                },
            }
        }
        if robot.name.is_empty() {
            faults.push(Fault::new(
                "list",
                format!("`{shown}`, row {}: no name in column `robot`", index + 1),
            ));
        }
        robots.push(robot);
    }
    if robots.is_empty() && faults.is_empty() {
        faults.push(Fault::new("list", format!("`{shown}` has no rows")));
    }
    Error::if_spec(faults).map(|()| robots)
}

fn is_parquet(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// What parts the cells of a text: the one of `,`, `;` and tab that the first line has most of.
fn delimiter(path: &Path, setting: &str) -> Result<u8> {
    let fault = |error: std::io::Error| {
        Error::spec(
            setting,
            format!("`{}` cannot be read: {error}", path.display()),
        )
    };
    let mut head = Vec::new();
    let mut reader = BufReader::new(raw::open(path).map_err(fault)?);
    reader.read_until(b'\n', &mut head).map_err(fault)?;
    let count = |delimiter: u8| head.iter().filter(|byte| **byte == delimiter).count();
    let most = [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|delimiter| count(*delimiter));
    Ok(most.unwrap_or(b','))
}

type Cells = (Vec<String>, Vec<Vec<String>>);

/// Names of columns, then rows, of a table of any kind.
fn cells(path: &Path) -> Result<Cells> {
    let shown = path.display().to_string();
    let fault = |error: String| Error::spec("list", format!("`{shown}` cannot be read: {error}"));
    let source = raw::source(path).map_err(|error| fault(error.to_string()))?;
    let text = TextLayout {
        delimiter: Delimiter::Byte(delimiter(path, "list")?),
        ..TextLayout::default()
    };
    let layout = TableLayout {
        text,
        ..TableLayout::default()
    };
    let broken = |error: Error| fault(error.to_string());
    let (_, mut reader) = records(source, &shown, layout).map_err(broken)?;
    let (mut record, mut rows) = (Record::default(), Vec::new());
    let mut columns: Option<Vec<String>> = None;
    while reader.next(&mut record).map_err(broken)? {
        let cells = record.cells();
        match &columns {
            None => columns = Some(cells),
            _ if cells.len() < 2 && record.is_blank(0) => (),
            Some(columns) if cells.len() != columns.len() => {
                let (line, have, want) = (record.line, cells.len(), columns.len());
                return Err(fault(format!("line {line} has {have} of {want} cells")));
            }
            Some(_) => rows.push(cells),
        }
    }
    let name = |name: &String| name.trim_start_matches('\u{feff}').trim().to_string();
    let columns = columns.iter().flatten().map(name).collect();
    Ok((columns, rows))
}

/// Rows read at a time.
const BATCH: usize = 1 << 10;

/// Parts the table at `path` by its column `by`; `variable` takes the file of a robot.
pub(super) fn read_recording(
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
        Some(names) => names,
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
