//! One row of a file as it stands, and what hands rows out.

use crate::error::{Error, Result};
use std::io;
use std::ops::Range;

/// Why a row is not used, whatever its columns are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordFault {
    /// It cannot be decoded.
    Damaged,
    /// It is of something else: of another robot's joints.
    Foreign,
    /// It was recorded at the moment of another one.
    DoubledStamp,
}

/// One row; reused from row to row.
#[derive(Default)]
pub struct Record {
    /// Line where it begins, from 1; of a file without lines the row.
    pub line: u64,
    /// The bytes as they stand, without the line end.
    pub text: Vec<u8>,
    /// Why its source says that it is not to be used.
    pub fault: Option<(RecordFault, String)>,
    /// The fields without quotes, of a row that has some.
    pub(super) unquoted: Vec<u8>,
    pub(super) is_quoted: bool,
    /// Places of its fields in `unquoted` where it has quotes, else in `text`.
    pub(super) fields: Vec<Range<usize>>,
}

impl Record {
    /// Starts a row whose fields are pushed one by one.
    pub fn begin(&mut self, line: u64) {
        self.line = line;
        self.text.clear();
        self.fields.clear();
        self.is_quoted = false;
        self.fault = None;
    }
    /// Adds a field.
    pub fn push(&mut self, field: &[u8]) {
        if !self.fields.is_empty() {
            self.text.push(b',');
        }
        let start = self.text.len();
        self.text.extend_from_slice(field);
        self.fields.push(start..self.text.len());
    }
    /// How many fields.
    pub fn len(&self) -> usize {
        self.fields.len()
    }
    /// Whether it has no field.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }
    /// A field without the blanks around it; empty beyond the last.
    pub fn field(&self, index: usize) -> &[u8] {
        let bytes = if self.is_quoted {
            &self.unquoted
        } else {
            &self.text
        };
        self.fields
            .get(index)
            .and_then(|range| bytes.get(range.clone()))
            .map_or(&[], <[u8]>::trim_ascii)
    }
    /// The fields as text for people.
    pub fn cells(&self) -> Vec<String> {
        (0..self.len())
            .map(|index| super::shown(self.field(index)).into_owned())
            .collect()
    }
    /// Whether nothing stands in the fields from this one on.
    pub fn is_blank(&self, from: usize) -> bool {
        (from..self.len()).all(|index| self.field(index).is_empty())
    }
}

/// Hands out the rows of one file, from its first byte to its last.
pub trait RecordReader: Send {
    /// The file as the person named it, of a workbook with its sheet.
    fn label(&self) -> &str;
    /// The names of the columns where it has them, then row by row; false at the end. Fails where the file is damaged.
    fn next(&mut self, record: &mut Record) -> Result<bool>;
    /// Lines of the file read so far; rows where it has no lines.
    fn lines(&self) -> u64;
    /// Bytes read so far.
    fn bytes(&self) -> u64;
    /// Whether the settings say if names stand above the data, and how numbers are written; other files say it themselves.
    fn is_text(&self) -> bool {
        false
    }
    /// Skips lines below the header, where the file has lines.
    fn skip(&mut self, _lines: u64) -> Result<()> {
        Ok(())
    }
    /// Which columns are asked for, and whether a row may lack them: others may be left blank.
    fn only(&mut self, _columns: &[(usize, bool)]) {}
    /// What could not be read of the file, once its last row was.
    fn loss(&self) -> Option<String> {
        None
    }
    /// What was left out of the file as a whole, for the person.
    fn remark(&self) -> Option<String> {
        None
    }
}

/// The fault of a file that cannot be read to its end.
pub fn failed(label: &str, error: &io::Error) -> Error {
    Error::store(label, format!("could not be read: {error}"))
}
