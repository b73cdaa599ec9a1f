//! Hashes of what rows say: of their ids, and of all else.

use super::recorded::RecordedRow;
use twox_hash::XxHash3_128;

/// Which hashes of a row are asked for.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Fingerprints {
    pub ids: bool,
    pub contents: bool,
}

/// 96 bits of an id's hash.
pub(super) fn hash_of(id: &str) -> (u64, u32) {
    let hash = XxHash3_128::oneshot(id.as_bytes());
    (hash as u64, (hash >> 64) as u32)
}

/// Makes hashes of rows; its room is used again.
#[derive(Debug, Clone, Default)]
pub(super) struct RowHasher {
    bytes: Vec<u8>,
}

impl RowHasher {
    /// Hash of the numbers, points and texts of a row; numbers stand in these places.
    pub(super) fn of(&mut self, row: &RecordedRow, places: &[usize]) -> u64 {
        self.bytes.clear();
        // What a row lacks says nothing: a circumstance more that may be declared costs a row nothing.
        for place in places {
            let value = row.values[*place];
            if !value.is_nan() {
                self.bytes.extend_from_slice(&(*place as u64).to_le_bytes());
                self.bytes.extend_from_slice(&value.to_bits().to_le_bytes());
            }
        }
        for value in row.points.iter().flatten() {
            self.bytes.extend_from_slice(&value.to_bits().to_le_bytes());
        }
        for (place, text) in row.texts.iter().enumerate().filter(|(_, text)| !text.is_empty()) {
            self.bytes.extend_from_slice([place, text.len()].map(|number| (number as u64).to_le_bytes()).as_flattened());
            self.bytes.extend_from_slice(text.as_bytes());
        }
        XxHash3_128::oneshot(&self.bytes) as u64
    }
}

/// Hash of rows and of one more.
pub(super) fn behind(before: u128, number: u64, content: u64) -> u128 {
    let mut bytes = [0; 32];
    bytes[..16].copy_from_slice(&before.to_le_bytes());
    bytes[16..24].copy_from_slice(&number.to_le_bytes());
    bytes[24..].copy_from_slice(&content.to_le_bytes());
    XxHash3_128::oneshot(&bytes)
}
