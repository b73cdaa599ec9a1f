//! What is remembered of the rows of a file: their point ids, and hashes of what they say.

use super::held::Texts;
use super::recorded::RecordedRow;
use crate::error::{Error, Result};
use twox_hash::XxHash3_128;

/// The point ids of the usable rows of a file, in its order.
#[derive(Default)]
pub(super) struct FileIds {
    pub ids: Texts,
    pub rows: Vec<NamedRow>,
    /// Some id is shorter than the one before it, or as long and not behind it in the alphabet. Otherwise none stands twice.
    pub is_mixed: bool,
}

/// A row that has a point id.
#[derive(Debug, Clone, Copy)]
pub(super) struct NamedRow {
    /// Data row in its file, from 1.
    pub number: u32,
    pub line: u32,
    /// Hash of what the row says, but for its place in the recording.
    pub content: u64,
}

impl FileIds {
    /// Adds a usable row, whose content has this hash.
    pub fn push(&mut self, row: &RecordedRow, content: u64, label: &str) -> Result<()> {
        let (id, last) = (
            row.id.as_bytes(),
            self.ids
                .len()
                .checked_sub(1)
                .and_then(|last| self.ids.bytes(last)),
        );
        self.is_mixed |= last.is_some_and(|last| (id.len(), id) <= (last.len(), last));
        self.ids.push(id);
        self.rows.push(NamedRow {
            number: narrow(row.number, label)?,
            line: narrow(row.line, label)?,
            content,
        });
        Ok(())
    }
    pub fn rows(&self) -> impl Iterator<Item = (&[u8], NamedRow)> {
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
