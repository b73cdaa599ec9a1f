//! One row of a raw file as it stands, and what a kind of file must do to hand out rows.

use super::layout::FileLayout;
use crate::error::{Error, Result};
use std::collections::VecDeque;
use std::io::{BufReader, Read};
use std::mem::take;
use std::ops::Range;

/// A file that is read from its first byte to its last.
pub(super) type Buffered = BufReader<Box<dyn Read + Send>>;

/// Bytes that are read at a time; what says of which kind a file is stands among the first of them.
pub(super) const BUFFER: usize = 1 << 16;

/// Hands out the rows of one file.
pub(super) trait RecordReader: Send {
    /// The file as the person named it, of a workbook with its sheet.
    fn label(&self) -> &str;
    /// The names of the columns where it has them, then row by row; false at the end. Fails where the file is damaged.
    fn next(&mut self, record: &mut RecordFields) -> Result<bool>;
    /// Lines of the file read so far; rows where it has no lines.
    fn lines(&self) -> u64;
    /// Bytes read so far.
    fn bytes(&self) -> u64;
    /// Whether the settings say if names stand above the data, and how numbers are written; other files say it themselves.
    fn is_text(&self) -> bool {
        false
    }
    /// The rows that come next, as a reader of its own that another thread may read to its end; `None` at the end. Continues behind what
    /// [`next`](Self::next) read, and nothing else is asked for afterwards.
    /// `room` is that of a block whose rows were used.
    fn block(&mut self, _room: Vec<u8>) -> Result<Option<Box<dyn RecordReader>>> {
        HeldRecords::of(self)
    }
    /// What a block that was read to its end leaves for another one.
    fn room(self: Box<Self>) -> Vec<u8> {
        Vec::new()
    }
    /// Skips lines below the header, where the file has lines.
    fn skip(&mut self, _lines: u64) -> Result<()> {
        Ok(())
    }
    /// What was left out of the file as a whole, for the person.
    fn remark(&self) -> Option<String> {
        None
    }
}

/// A kind of file.
pub(super) struct FileFormat {
    /// Whether a file is of this kind, by the ending of its name and its first bytes.
    pub is: fn(&str, &[u8]) -> bool,
    /// Whether it has sheets, of which the settings may name one.
    pub has_sheets: bool,
    /// Opens it; the label is the file as the person named it. Fails where it is not what it says that it is.
    pub open: fn(Buffered, &str, &FileLayout) -> Result<Box<dyn RecordReader>>,
}

/// One row; reused from row to row.
#[derive(Default)]
pub(super) struct RecordFields {
    /// Line where it begins, from 1.
    pub line: u64,
    /// The bytes as they stand, without the line end.
    pub text: Vec<u8>,
    /// The same without quotes, where it has any.
    pub unquoted: Vec<u8>,
    pub quoted: bool,
    /// Places of its fields in `unquoted` where it has quotes, else in `text`.
    pub fields: Vec<Range<usize>>,
}

impl RecordFields {
    /// Starts a row whose fields are pushed one by one.
    pub(super) fn begin(&mut self, line: u64) {
        self.line = line;
        self.text.clear();
        self.fields.clear();
        self.quoted = false;
    }
    pub(super) fn push(&mut self, field: &[u8]) {
        if !self.fields.is_empty() {
            self.text.push(b',');
        }
        let start = self.text.len();
        self.text.extend_from_slice(field);
        self.fields.push(start..self.text.len());
    }
    pub(super) fn len(&self) -> usize {
        self.fields.len()
    }
    /// A field without the blanks around it.
    pub(super) fn field(&self, index: usize) -> Option<&[u8]> {
        let bytes = if self.quoted { &self.unquoted } else { &self.text };
        self.fields.get(index).and_then(|range| bytes.get(range.clone())).map(<[u8]>::trim_ascii)
    }
    pub(super) fn is_blank(&self, from: usize) -> bool {
        (from..self.len()).all(|index| self.field(index).is_some_and(<[u8]>::is_empty))
    }
}

/// Rows that are held at a time, of a file that is not cut into blocks of its own.
const HELD: usize = 1 << 11;

/// Rows that were read, handed out once more.
#[derive(Default)]
pub(super) struct HeldRecords {
    label: String,
    records: VecDeque<RecordFields>,
    /// Lines and bytes of the file up to the last of these rows.
    lines: u64,
    bytes: u64,
}

impl HeldRecords {
    /// The next rows of a file; nothing at its end.
    fn of(reader: &mut (impl RecordReader + ?Sized)) -> Result<Option<Box<dyn RecordReader>>> {
        let mut records = VecDeque::with_capacity(HELD);
        let mut record = RecordFields::default();
        while records.len() < HELD && reader.next(&mut record)? {
            records.push_back(take(&mut record));
        }
        if records.is_empty() {
            return Ok(None);
        }
        Ok(Some(Box::new(Self { label: reader.label().into(), records, lines: reader.lines(), bytes: reader.bytes() })))
    }
    /// One row alone, which a file of so many lines and bytes began with.
    pub(super) fn one(record: RecordFields, reader: &dyn RecordReader) -> Self {
        Self { label: reader.label().into(), records: [record].into(), lines: reader.lines(), bytes: reader.bytes() }
    }
}

impl RecordReader for HeldRecords {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        let next = self.records.pop_front();
        Ok(next.map(|next| *record = next).is_some())
    }
    fn lines(&self) -> u64 {
        self.lines
    }
    fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// The fault of a file that cannot be read to its end.
pub(super) fn failed(label: &str, error: &std::io::Error) -> Error {
    Error::store(label, format!("could not be read: {error}"))
}
