//! A file of any kind as the tables that are in it.

use super::sheet::Sheet;
use crate::error::{Error, Result};
use crate::raw::{
    self, BagTopic, DecimalMark, InputSource, Record, Workbook, bag_content, failed, is_utf16,
    shown,
};
use crate::stage::ingest::{FileKind, TableLayout, records};
use std::io::{BufRead, BufReader, Read, Seek};
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
    let understood = |sheets: Result<Vec<Sheet>, String>| {
        Ok(sheets.unwrap_or_else(|trouble| vec![Sheet::not_understood(trouble)]))
    };
    match FileKind::of(&place, head) {
        FileKind::Workbook => return understood(sheets(reader, places)),
        FileKind::Bag => {
            return understood(topics(path, &place).map_err(|error| error.to_string()));
        }
        FileKind::NotRead(what) => return understood(Err(what.into())),
        FileKind::Text => {}
        // What says itself what its columns are.
        kind => {
            let mut file = reader.into_inner();
            file.rewind().map_err(failed)?;
            let sheet = first_rows(file, &place, None).map(|(names, rows)| {
                // A name, then six joints.
                let degrees =
                    |column| matches!(kind, FileKind::Program(_)) && (1..=6).contains(&column);
                let unit = |column| degrees(column).then_some("deg");
                vec![Sheet {
                    units: (0..names.len()).map(unit).collect(),
                    ..Sheet::of_columns(names, rows)
                }]
            });
            return understood(sheet.map_err(|error| error.to_string()));
        }
    }
    if !is_utf16(head) && head.contains(&0) {
        return understood(Err("no text".into()));
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

/// The names and the first rows of a table that says itself what its columns are.
fn first_rows(
    source: Box<dyn InputSource>,
    label: &str,
    topic: Option<&str>,
) -> Result<(Vec<String>, Vec<Vec<String>>)> {
    let layout = TableLayout {
        topic,
        ..TableLayout::default()
    };
    let (_, mut rows) = records(source, label, layout)?;
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
        let (names, rows) = first_rows(opened()?, place, Some(&topic.name))?;
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
            .lines(name, DecimalMark::Point)?
            .lines()
            .take(LINES)
            .map(String::from)
            .collect();
        Ok(Sheet::of_workbook(name, &lines))
    };
    names.iter().map(sheet).collect()
}
