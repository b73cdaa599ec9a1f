//! A file of any kind as the tables that are in it.

use super::sheet::Sheet;
use crate::error::{Error, Result};
use crate::program::listing;
use crate::raw::{self, Utf16Reader, Workbook, is_utf16, is_workbook, not_read};
use crate::stage::ingest::{ListedTable, encoding, first_rows};
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
    if is_workbook(head) {
        return Ok(sheets(reader, places).unwrap_or_else(|trouble| vec![Sheet::not_understood(trouble)]));
    }
    if let Some(language) = listing(&raw::ending(path), head) {
        let table = ListedTable::read(reader, &place, language);
        return Ok(vec![table.map_or_else(|error| Sheet::not_understood(error.to_string()), Sheet::of_program)]);
    }
    if let Some(what) = not_read(head) {
        return Ok(vec![Sheet::not_understood(what.into())]);
    }
    if !is_utf16(head) && head.contains(&0) {
        let rows = first_rows(Box::new(reader), &place, LINES);
        return Ok(vec![match rows {
            Ok(rows) => rows.map_or_else(|| Sheet::not_understood("no text".into()), Sheet::of_columns),
            Err(error) => Sheet::not_understood(error.to_string()),
        }]);
    }
    let mut lines: Vec<String> = Vec::new();
    let wide = is_utf16(head);
    let text: Box<dyn BufRead> = if wide { Box::new(BufReader::new(Utf16Reader::new(reader))) } else { Box::new(reader) };
    for line in text.take(LOOKED).split(b'\n').take(LINES) {
        let line = line.map_err(failed)?;
        lines.push(encoding::shown(&line).trim_end_matches('\r').trim_start_matches('\u{feff}').to_string());
    }
    Ok(vec![Sheet::of(&lines)])
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
