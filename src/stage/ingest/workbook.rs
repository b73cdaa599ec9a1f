//! A sheet of a workbook, read as text is: its cells are delimited, and its numbers have the decimal mark that the settings announce.

use super::layout::{Decimal, FileLayout};
use super::lines::TextReader;
use super::record::{Buffered, FileFormat, RecordReader};
use crate::error::{Error, Result};
use crate::raw::{Workbook, is_workbook};
use std::io::{BufReader, Cursor, Read};

pub(super) const FORMAT: FileFormat = FileFormat { is: |_, head| is_workbook(head), has_sheets: true, open };

fn open(source: Buffered, label: &str, layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    let data = |message: String| Error::data(label, message);
    let mut book = Workbook::read(source).map_err(data)?;
    let name = book.sheet(layout.sheet.as_deref()).map_err(data)?;
    let mark = if layout.decimal == Decimal::Comma { ',' } else { '.' };
    let lines: Box<dyn Read + Send> = Box::new(Cursor::new(book.lines(&name, mark).map_err(data)?));
    let layout = FileLayout { delimiter: "tab".into(), ..layout.clone() };
    Ok(Box::new(TextReader::open(BufReader::new(lines), &format!("{label} sheet `{name}`"), &layout)?))
}
