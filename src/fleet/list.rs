//! Robots from a list: a table of any kind, one row a robot.

use super::robot::FleetRobot;
use crate::error::{Error, Fault, Result, instead};
use crate::pipeline::Override;
use crate::raw::{self, Delimiter, Record, TextLayout};
use crate::stage::ingest::{TableLayout, records};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Columns that a list may have beside `set.TARGET` and `path.TARGET`.
const COLUMNS: [&str; 5] = ["robot", "folder", "model", "plant", "campaign"];

/// Reads a list; `variable` takes the folder. Fails with every fault of its columns and rows.
pub(super) fn read(path: &Path, variable: &str) -> Result<Vec<FleetRobot>> {
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

pub(super) fn is_parquet(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// What parts the cells of a text: the one of `,`, `;` and tab that the first line has most of.
pub(super) fn delimiter(path: &Path, setting: &str) -> Result<u8> {
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
