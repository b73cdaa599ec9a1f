//! Robots from a list: CSV or Parquet, one row a robot.

use super::robot::FleetRobot;
use crate::error::{Error, Fault, Result, nearest};
use crate::pipeline::Override;
use crate::raw;
use arrow::util::display::array_value_to_string;
use std::fs::File;
use std::path::Path;

/// Columns that a list may have beside `set.TARGET` and `path.TARGET`.
const COLUMNS: [&str; 5] = ["robot", "folder", "model", "plant", "campaign"];

/// Rows read at a time.
const BATCH: usize = 1 << 10;

/// Reads a list; `variable` takes the folder. Fails with every fault of its columns and rows.
pub(super) fn read(path: &Path, variable: &str) -> Result<Vec<FleetRobot>> {
    let (columns, rows) = if is_parquet(path) {
        parquet(path)?
    } else {
        csv(path)?
    };
    let shown = path.display();
    let mut faults = Vec::new();
    for column in &columns {
        if !COLUMNS.contains(&column.as_str())
            && !column.starts_with("set.")
            && !column.starts_with("path.")
        {
            let hint = nearest(column, COLUMNS)
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_else(|| ".".into());
            let message = format!(
                "`{shown}` has a column {column:?}{hint} Allowed: {}, set.TARGET, path.TARGET",
                COLUMNS.join(", ")
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
    if faults.is_empty() {
        Ok(robots)
    } else {
        Err(Error::Spec(faults))
    }
}

pub(super) fn is_parquet(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// A reader of delimited text with a header, its delimiter the one of `,`, `;` and tab that the first line has most of.
pub(super) fn csv_reader(path: &Path, setting: &str) -> Result<csv::Reader<File>> {
    let fault = |error: std::io::Error| {
        Error::spec(
            setting,
            format!("`{}` cannot be read: {error}", path.display()),
        )
    };
    let mut head = String::new();
    std::io::BufRead::read_line(
        &mut std::io::BufReader::new(raw::open(path).map_err(fault)?),
        &mut head,
    )
    .map_err(fault)?;
    let count = |delimiter: u8| head.bytes().filter(|byte| *byte == delimiter).count();
    let delimiter = [b',', b';', b'\t']
        .into_iter()
        .rev()
        .max_by_key(|delimiter| count(*delimiter))
        .unwrap_or(b',');
    Ok(csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .from_reader(raw::open(path).map_err(fault)?))
}

type Cells = (Vec<String>, Vec<Vec<String>>);

fn csv(path: &Path) -> Result<Cells> {
    let mut reader = csv_reader(path, "list")?;
    let fault = |error: csv::Error| Error::spec("list", format!("`{}`: {error}", path.display()));
    let text = |record: &csv::StringRecord| record.iter().map(String::from).collect::<Vec<_>>();
    let columns = text(reader.headers().map_err(fault)?);
    let columns = columns
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}').trim().to_string())
        .collect();
    let rows = reader
        .records()
        .map(|record| record.map(|record| text(&record)).map_err(fault))
        .collect::<Result<_>>()?;
    Ok((columns, rows))
}

fn parquet(path: &Path) -> Result<Cells> {
    let fault = |error: String| {
        Error::spec(
            "list",
            format!("`{}` cannot be read: {error}", path.display()),
        )
    };
    let file = raw::open(path).map_err(|error| fault(error.to_string()))?;
    let reader = raw::parquet(file, BATCH).map_err(fault)?;
    let (mut columns, mut rows) = (Vec::new(), Vec::new());
    for batch in reader {
        let batch = batch.map_err(fault)?;
        columns = batch
            .schema()
            .fields()
            .iter()
            .map(|field| field.name().clone())
            .collect();
        for row in 0..batch.num_rows() {
            let cells = batch
                .columns()
                .iter()
                .map(|column| array_value_to_string(column, row));
            rows.push(
                cells
                    .collect::<Result<_, _>>()
                    .map_err(|error| fault(error.to_string()))?,
            );
        }
    }
    Ok((columns, rows))
}
