//! Rows of a file as they were judged, in columns: handed out again to be written, and found by number as partners of other rows.
//!
//! Of each row its point id is remembered with a hash of what the row says. A file that takes more memory than it may is read again instead; what partners need of it is held all the same.

use super::bind::Binding;
use super::reading::OpenedFile;
use super::refusal::RowRefusal;
use super::row::RecordedRow;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use twox_hash::XxHash3_128;

/// Texts one behind the other.
#[derive(Default)]
pub(super) struct Texts {
    text: Vec<u8>,
    ends: Vec<usize>,
}

impl Texts {
    pub(super) fn push(&mut self, text: &[u8]) {
        self.text.extend_from_slice(text);
        self.ends.push(self.text.len());
    }
    pub(super) fn bytes(&self, at: usize) -> Option<&[u8]> {
        let end = *self.ends.get(at)?;
        self.text
            .get(at.checked_sub(1).map_or(0, |before| self.ends[before])..end)
    }
    pub(super) fn get(&self, at: usize) -> Option<&str> {
        self.bytes(at)
            .and_then(|bytes| std::str::from_utf8(bytes).ok())
    }
    /// About what it takes of memory.
    fn size(&self) -> usize {
        self.text.len() + 8 * self.ends.len()
    }
}

/// The rows of a file, from the first.
#[derive(Default)]
pub(super) struct HeldRows {
    /// Places of a row's numbers that the file fills.
    pub(crate) places: Vec<usize>,
    /// Their values, row by row.
    pub(crate) values: Vec<f64>,
    /// The points of wide rows, of so many targets each.
    pub(crate) points: Vec<[f64; 3]>,
    targets: usize,
    pub(crate) ids: Texts,
    /// Places of a row's texts that the file has, and the texts of each.
    texts: Vec<(usize, Texts)>,
    /// What only writing its rows needs; given up where it is too much.
    written: Option<WrittenRows>,
    /// Whether rows of another file look for partners here.
    has_partners: bool,
    /// Bytes of memory that may be taken.
    most: usize,
}

#[derive(Default)]
struct WrittenRows {
    lines: Vec<u64>,
    /// Where the file says it.
    sequence: Vec<i64>,
    /// As they stand in the file.
    records: Texts,
    /// By index.
    refused: BTreeMap<usize, RowRefusal>,
}

impl HeldRows {
    pub(super) fn new(binding: &Binding, has_partners: bool, most: usize) -> Self {
        let texts = binding
            .worded
            .iter()
            .map(|place| (*place, Texts::default()));
        Self {
            places: binding.filled.clone(),
            texts: texts.collect(),
            targets: binding.points.len(),
            written: Some(WrittenRows::default()),
            has_partners,
            most,
            ..Self::default()
        }
    }

    /// Takes the present row of a file.
    pub(super) fn push(&mut self, open: &OpenedFile, judged: &Result<(), RowRefusal>) {
        if self.written.is_none() && !self.has_partners {
            return;
        }
        let row = &open.row;
        self.values
            .extend(self.places.iter().map(|place| row.values[*place]));
        self.points
            .extend((0..self.targets).map(|k| row.points.get(k).copied().unwrap_or([f64::NAN; 3])));
        self.ids.push(row.id.as_bytes());
        self.texts
            .iter_mut()
            .for_each(|(place, texts)| texts.push(row.texts[*place].as_bytes()));
        let Some(written) = &mut self.written else {
            return;
        };
        written.lines.push(row.line);
        if open.binding().sequence.is_some() {
            written.sequence.push(row.sequence.unwrap_or(i64::MIN));
        }
        written.records.push(open.text());
        if let Err(refusal) = judged {
            written
                .refused
                .insert(written.lines.len() - 1, refusal.clone());
        }
        let texts: usize = self.texts.iter().map(|(_, texts)| texts.size()).sum();
        let refused =
            written.refused.len() * 128 + written.records.size() + 16 * written.lines.len();
        if 8 * self.values.len() + 24 * self.points.len() + self.ids.size() + texts + refused
            > self.most
        {
            self.written = None;
            if !self.has_partners {
                *self = Self::default();
            }
        }
    }

    /// The text of a row in this place of its texts.
    pub(super) fn text(&self, place: usize, at: usize) -> Option<&str> {
        self.texts
            .iter()
            .find(|(of_text, _)| *of_text == place)?
            .1
            .get(at)
    }

    /// The rows; none where the file must be read again.
    pub(super) fn rows(&self, row: RecordedRow) -> Option<HeldReading<'_>> {
        Some(HeldReading {
            held: self,
            written: self.written.as_ref()?,
            row,
        })
    }
}

/// Hands out the rows of a file.
pub(super) struct HeldReading<'a> {
    held: &'a HeldRows,
    written: &'a WrittenRows,
    row: RecordedRow,
}

/// The rows of a file, held or read again.
pub(super) enum RowSource<'a> {
    Held(HeldReading<'a>),
    File(Box<OpenedFile<'a>>),
}

impl RowSource<'_> {
    pub(super) fn row(&self) -> &RecordedRow {
        match self {
            Self::Held(held) => &held.row,
            Self::File(open) => &open.row,
        }
    }
    /// The present row as it stands in the file.
    pub(super) fn text(&self) -> &[u8] {
        match self {
            Self::Held(held) => held
                .written
                .records
                .bytes(held.row.number as usize - 1)
                .unwrap_or_default(),
            Self::File(open) => open.text(),
        }
    }
    /// Goes on to the next row: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Result<(), RowRefusal>>> {
        match self {
            Self::Held(held) => Ok(held.next()),
            Self::File(open) => open.next(),
        }
    }
}

impl HeldReading<'_> {
    fn next(&mut self) -> Option<Result<(), RowRefusal>> {
        let (held, row) = (self.held, &mut self.row);
        let at = row.number as usize;
        row.line = *self.written.lines.get(at)?;
        row.number += 1;
        let width = held.places.len();
        for (place, value) in held.places.iter().zip(&held.values[at * width..]) {
            row.values[*place] = *value;
        }
        row.points.clear();
        row.points
            .extend_from_slice(&held.points[at * held.targets..(at + 1) * held.targets]);
        let put = |text: &mut String, from: &Texts| {
            text.clear();
            text.push_str(from.get(at).unwrap_or_default());
        };
        put(&mut row.id, &held.ids);
        held.texts
            .iter()
            .for_each(|(place, texts)| put(&mut row.texts[*place], texts));
        row.sequence = self
            .written
            .sequence
            .get(at)
            .copied()
            .filter(|number| *number != i64::MIN);
        let refusal = self.written.refused.get(&at).cloned();
        Some(refusal.map_or(Ok(()), Err))
    }
}

/// The point ids of the usable rows of a file, in its order.
#[derive(Default)]
pub(super) struct FileIds {
    pub(crate) ids: Texts,
    pub(crate) rows: Vec<NamedRow>,
}

/// A row that has a point id.
#[derive(Debug, Clone, Copy)]
pub(super) struct NamedRow {
    /// Data row in its file, from 1.
    pub(crate) number: u32,
    pub(crate) line: u32,
    /// Hash of what the row says, but for its place in the recording.
    pub(crate) content: u64,
}

impl FileIds {
    /// Adds a usable row, whose content has this hash.
    pub(crate) fn push(&mut self, row: &RecordedRow, content: u64, label: &str) -> Result<()> {
        self.ids.push(row.id.as_bytes());
        self.rows.push(NamedRow {
            number: narrow(row.number, label)?,
            line: narrow(row.line, label)?,
            content,
        });
        Ok(())
    }
    pub(crate) fn rows(&self) -> impl Iterator<Item = (&[u8], NamedRow)> {
        self.rows
            .iter()
            .enumerate()
            .filter_map(|(at, row)| Some((self.ids.bytes(at)?, *row)))
    }
}

/// The number of a row, as it is kept of every one.
pub(super) fn narrow(number: u64, label: &str) -> Result<u32> {
    u32::try_from(number).map_err(|_| Error::data(label, "more than 4294967295 rows"))
}

/// Makes hashes of rows; its room is used again.
#[derive(Default)]
pub(super) struct RowHasher {
    bytes: Vec<u8>,
}

impl RowHasher {
    /// Hash of the numbers, points and texts of a row; numbers stand in these places.
    pub(super) fn of(&mut self, row: &RecordedRow, places: &[usize]) -> u64 {
        self.bytes.clear();
        // What a row lacks says nothing: a circumstance more that may be declared costs a row nothing.
        for place in places.iter().filter(|place| !row.values[**place].is_nan()) {
            self.bytes.extend_from_slice(
                [*place as u64, row.values[*place].to_bits()]
                    .map(u64::to_le_bytes)
                    .as_flattened(),
            );
        }
        for value in row.points.iter().flatten() {
            self.bytes.extend_from_slice(&value.to_bits().to_le_bytes());
        }
        for (place, text) in row
            .texts
            .iter()
            .enumerate()
            .filter(|(_, text)| !text.is_empty())
        {
            self.bytes.extend_from_slice(
                [place, text.len()]
                    .map(|number| (number as u64).to_le_bytes())
                    .as_flattened(),
            );
            self.bytes.extend_from_slice(text.as_bytes());
        }
        XxHash3_128::oneshot(&self.bytes) as u64
    }
}

/// Hash of rows and of one more.
pub(super) fn behind(before: u64, number: u64, content: u64) -> u64 {
    XxHash3_128::oneshot(
        [before, number, content]
            .map(u64::to_le_bytes)
            .as_flattened(),
    ) as u64
}
