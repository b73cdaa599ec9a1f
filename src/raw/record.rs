//! One row of a file as it stands, what hands rows out, and where the bytes of an input lie.

use super::{ending, open};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

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
    /// Another field behind the last.
    pub fn push(&mut self, field: &[u8]) {
        if !self.fields.is_empty() {
            self.text.push(b',');
        }
        let start = self.text.len();
        self.text.extend_from_slice(field);
        self.fields.push(start..self.text.len());
    }
    /// Number of fields.
    pub fn len(&self) -> usize {
        self.fields.len()
    }
    /// Whether it has none.
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
    /// The names of the columns where it has them, then row by row; false at the end. Fails where the file is damaged.
    fn next(&mut self, record: &mut Record) -> Result<bool>;
    /// Lines of the file read so far; rows where it has no lines.
    fn lines(&self) -> u64;
    /// Bytes read so far.
    fn bytes(&self) -> u64;
    /// Whether the settings say if names stand above the data, and how numbers are written; other files say it themselves.
    fn obeys_layout(&self) -> bool {
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

/// What the parts of a bag end in.
const PARTS: [&str; 2] = ["mcap", "db3"];

/// Bytes that can be read at any place.
pub trait InputSource: Read + Seek + Send {
    /// Where each part begins, then where the last one ends. Leaves the place at the beginning.
    fn bounds(&mut self) -> io::Result<Vec<u64>> {
        let end = self.seek(SeekFrom::End(0))?;
        self.rewind()?;
        Ok(vec![0, end])
    }
}

impl InputSource for File {}
impl InputSource for Cursor<Vec<u8>> {}

/// Opens a regular file, or a folder that holds the parts of a bag.
pub fn source(path: &Path) -> io::Result<Box<dyn InputSource>> {
    if !path.is_dir() {
        return Ok(Box::new(open(path)?));
    }
    let mut parts: Vec<PathBuf> = Vec::new();
    for entry in path.read_dir()? {
        let part = entry?.path();
        if PARTS.contains(&ending(&part).as_str()) && part.is_file() {
            parts.push(part);
        }
    }
    // run_2 comes before run_10.
    let number = |path: &PathBuf| {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        (
            name[..name.len() - digits].to_string(),
            name[name.len() - digits..].parse::<u64>().ok(),
        )
    };
    parts.sort_by_cached_key(|part| (number(part), part.clone()));
    let of_kind = |kind: &str| parts.iter().any(|part| ending(part) == kind);
    if !PARTS.iter().any(|kind| of_kind(kind)) || PARTS.iter().all(|kind| of_kind(kind)) {
        let message = "is a folder; allowed: a file, or a folder with the parts of one bag, all .mcap or all .db3";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    let mut all = JoinedParts {
        files: Vec::new(),
        bounds: vec![0],
        at: 0,
    };
    for part in parts {
        let file = open(&part)?;
        all.bounds
            .push(all.bounds[all.files.len()] + file.metadata()?.len());
        all.files.push(file);
    }
    Ok(Box::new(all))
}

/// Files one behind the other.
struct JoinedParts {
    files: Vec<File>,
    bounds: Vec<u64>,
    at: u64,
}

impl Read for JoinedParts {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let part = self.bounds.partition_point(|bound| *bound <= self.at);
        let (Some(end), Some(file)) = (
            self.bounds.get(part),
            self.files.get_mut(part.wrapping_sub(1)),
        ) else {
            return Ok(0);
        };
        let most = usize::try_from(end - self.at)
            .unwrap_or(usize::MAX)
            .min(buffer.len());
        file.seek(SeekFrom::Start(self.at - self.bounds[part - 1]))?;
        let read = file.read(&mut buffer[..most])?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for JoinedParts {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let end = self.bounds.last().copied().unwrap_or_default();
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => end.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at =
            at.ok_or_else(|| io::Error::new(ErrorKind::InvalidInput, "before the first byte"))?;
        Ok(self.at)
    }
}

impl InputSource for JoinedParts {
    fn bounds(&mut self) -> io::Result<Vec<u64>> {
        self.at = 0;
        Ok(self.bounds.clone())
    }
}
