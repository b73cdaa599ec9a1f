//! A file of any kind as the tables that are in it.

use super::sheet::Sheet;
use crate::error::{Error, Result};
use crate::program::listing;
use crate::raw::{
    self, BagRows, BagTopic, ColumnRows, Record, RecordReader, Workbook, bag_content, failed,
    has_columns, is_bag, is_utf16, is_workbook, not_read, shown,
};
use crate::stage::ingest::ListedTable;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Bytes and lines that are looked at.
const LOOKED: u64 = 16 << 20;
const LINES: usize = 20_000;

/// The table of a file; of a workbook its sheets with rows of numbers, where there are so many places for them.
pub(super) fn tables(path: &Path, places: usize) -> Result<Vec<Sheet>> {
    let place = path.display().to_string();
    let file = raw::source(path)
        .map_err(|error| Error::spec(&place, format!("cannot be read: {error}")))?;
    let failed = |error: std::io::Error| Error::store(&place, format!("cannot be read: {error}"));
    let mut reader = BufReader::new(file);
    let head = reader.fill_buf().map_err(failed)?;
    let one = |sheet: std::result::Result<Sheet, String>| {
        vec![sheet.unwrap_or_else(Sheet::not_understood)]
    };
    if is_workbook(head) {
        return Ok(
            sheets(reader, places).unwrap_or_else(|trouble| vec![Sheet::not_understood(trouble)])
        );
    }
    if is_bag(head) {
        return Ok(topics(path, &place)
            .unwrap_or_else(|error| vec![Sheet::not_understood(error.to_string())]));
    }
    if let Some(language) = listing(&raw::ending(path), head) {
        let table = ListedTable::read(reader, &place, language);
        return Ok(one(table
            .map(Sheet::of_program)
            .map_err(|error| error.to_string())));
    }
    if let Some(what) = not_read(head) {
        return Ok(one(Err(what.into())));
    }
    if has_columns(head) {
        return Ok(one(
            columns(reader, &place).map_err(|error| error.to_string())
        ));
    }
    if !is_utf16(head) && head.contains(&0) {
        return Ok(one(Err("no text".into())));
    }
    let mut lines: Vec<String> = Vec::new();
    let text = raw::without_utf16(reader).map_err(failed)?;
    for line in BufReader::new(text).take(LOOKED).split(b'\n').take(LINES) {
        let line = line.map_err(failed)?;
        lines.push(
            shown(&line)
                .trim_end_matches('\r')
                .trim_start_matches('\u{feff}')
                .to_string(),
        );
    }
    Ok(vec![Sheet::of(&lines)])
}

/// The first rows of a file of columns.
fn columns(source: impl Read, label: &str) -> Result<Sheet> {
    let (names, rows) = first_rows(&mut ColumnRows::open(source, label)?)?;
    Ok(Sheet::of_columns(names, rows))
}

fn first_rows(rows: &mut dyn RecordReader) -> Result<(Vec<String>, Vec<Vec<String>>)> {
    let (mut record, mut found) = (Record::default(), Vec::new());
    while found.len() <= LINES && rows.next(&mut record)? {
        if record.fault.is_none() {
            found.push(record.cells());
        }
    }
    Ok((found.remove(0), found))
}

/// Of a recording of ROS 2 the topic of joints with most messages, and that of points; with a line on every topic.
fn topics(path: &Path, place: &str) -> Result<Vec<Sheet>> {
    let opened = || raw::source(path).map_err(|error| failed(place, &error));
    let content = bag_content(opened()?, place)?;
    let most = |wanted: &[&str]| {
        let fits = |topic: &&BagTopic| {
            topic.messages > 0 && wanted.iter().any(|kind| topic.kind.ends_with(kind))
        };
        content
            .topics
            .iter()
            .filter(fits)
            .max_by_key(|topic| topic.messages)
    };
    let chosen = [
        most(&["/JointState"]),
        most(&[
            "/PointStamped",
            "/PoseStamped",
            "/TransformStamped",
            "/TFMessage",
        ]),
    ];
    let mut sheets = Vec::new();
    for topic in chosen.into_iter().flatten() {
        let (names, rows) = first_rows(&mut BagRows::open(opened()?, place, Some(&topic.name))?)?;
        sheets.push(Sheet::of_topic(topic, names, rows));
    }
    if sheets.is_empty() {
        sheets.push(Sheet::not_understood("no topic of joints or points".into()));
    }
    let lines = content.topics.iter().map(BagTopic::account);
    sheets[0].notes = lines.chain(content.loss).collect();
    Ok(sheets)
}

fn sheets(source: impl Read, places: usize) -> Result<Vec<Sheet>, String> {
    let mut book = Workbook::read(source)?;
    let tables = book.tables()?;
    let one = [if (1..=places).contains(&tables.len()) {
        String::new()
    } else {
        book.sheet(None)?
    }];
    let names = if one[0].is_empty() { &tables[..] } else { &one };
    let sheet = |name: &String| {
        let lines: Vec<String> = book
            .lines(name, '.')?
            .lines()
            .take(LINES)
            .map(String::from)
            .collect();
        Ok(Sheet::of_workbook(name, &lines))
    };
    names.iter().map(sheet).collect()
}
