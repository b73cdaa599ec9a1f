//! A file of any kind as the tables that are in it.

use super::sheet::Sheet;
use crate::error::{Error, Result};
use crate::program::listing;
use crate::raw::{self, ColumnRows, Record, RecordReader, Workbook, has_columns, is_utf16, is_workbook, not_read, shown};
use crate::stage::ingest::ListedTable;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Bytes and lines that are looked at.
const LOOKED: u64 = 16 << 20;
const LINES: usize = 20_000;

/// The table of a file; of a workbook its sheets with rows of numbers, where there are so many places for them.
pub(super) fn tables(path: &Path, places: usize) -> Result<Vec<Sheet>> {
    let place = path.display().to_string();
    let file = raw::open(path).map_err(|error| Error::spec(&place, format!("cannot be read: {error}")))?;
    let failed = |error: std::io::Error| Error::store(&place, format!("cannot be read: {error}"));
    let mut reader = BufReader::new(file);
    let head = reader.fill_buf().map_err(failed)?;
    let one = |sheet: std::result::Result<Sheet, String>| vec![sheet.unwrap_or_else(Sheet::not_understood)];
    if is_workbook(head) {
        return Ok(sheets(reader, places).unwrap_or_else(|trouble| vec![Sheet::not_understood(trouble)]));
    }
    if let Some(language) = listing(&raw::ending(path), head) {
        let table = ListedTable::read(reader, &place, language);
        return Ok(one(table.map(Sheet::of_program).map_err(|error| error.to_string())));
    }
    if let Some(what) = not_read(head) {
        return Ok(one(Err(what.into())));
    }
    if has_columns(head) {
        return Ok(one(columns(reader, &place).map_err(|error| error.to_string())));
    }
    if !is_utf16(head) && head.contains(&0) {
        return Ok(one(Err("no text".into())));
    }
    let mut lines: Vec<String> = Vec::new();
    let text = raw::without_utf16(reader).map_err(failed)?;
    for line in BufReader::new(text).take(LOOKED).split(b'\n').take(LINES) {
        let line = line.map_err(failed)?;
        lines.push(shown(&line).trim_end_matches('\r').trim_start_matches('\u{feff}').to_string());
    }
    Ok(vec![Sheet::of(&lines)])
}

/// The first rows of a file of columns.
fn columns(source: impl Read, label: &str) -> Result<Sheet> {
    let (mut rows, mut record, mut found) = (ColumnRows::open(source, label)?, Record::default(), Vec::new());
    while found.len() <= LINES && rows.next(&mut record)? {
        found.push(record.cells());
    }
    Ok(Sheet::of_columns(found.remove(0), found))
}

fn sheets(source: impl Read, places: usize) -> Result<Vec<Sheet>, String> {
    let mut book = Workbook::read(source)?;
    let tables = book.tables()?;
    let one = [if (1..=places).contains(&tables.len()) { String::new() } else { book.sheet(None)? }];
    let names = if one[0].is_empty() { &tables[..] } else { &one };
    let sheet = |name: &String| {
        let lines: Vec<String> = book.lines(name, '.')?.lines().take(LINES).map(String::from).collect();
        Ok(Sheet::of_workbook(name, &lines))
    };
    names.iter().map(sheet).collect()
}
