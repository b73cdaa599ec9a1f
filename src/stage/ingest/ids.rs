//! Which usable rows of a file have which point id: fingerprints in the order of the file, found again by id.
//!
//! Memory: 32 bytes a row; 16 more where ids neither ascend nor stand in the order in which they are looked for.

use super::recorded::RecordedRow;
use crate::error::{Error, Result};
use rayon::slice::ParallelSliceMut;

/// What is remembered of a point id: 96 bits of its hash (two ids in 10^7 are confused once in 10^14 files) and its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct IdFingerprint {
    pub hash: u64,
    pub check: u32,
    /// Index of the file.
    pub file: u32,
    /// Data row in its file, from 1.
    pub number: u32,
    pub line: u32,
    /// Hash of what the row says, but for its place in the recording.
    pub content: u64,
}

/// The ids of the usable rows of a file, or of files that continue each other.
#[derive(Default)]
pub(super) struct FileIds {
    /// In the order of the files.
    keys: Vec<IdFingerprint>,
    last: String,
    /// Some id is shorter than the one before it, or as long and not behind it in the alphabet. Otherwise none stands twice.
    mixed: bool,
    /// Where the id that is looked for next is expected.
    next: usize,
    /// Hashes and places of the keys, by hash; made when they are needed.
    sorted: Vec<(u64, u32)>,
}

/// Keys that are passed over before one is looked for among all.
const NEAR: usize = 4;

impl FileIds {
    /// Adds a usable row, which has its hashes.
    pub fn push(&mut self, row: &RecordedRow, file: usize, label: &str) -> Result<()> {
        let (hash, check) = row.key;
        let (number, line) = (narrow(row.number, label)?, narrow(row.line, label)?);
        if !self.mixed {
            self.mixed = (row.id.len(), &row.id) <= (self.last.len(), &self.last);
            self.last.clone_from(&row.id);
        }
        self.keys.push(IdFingerprint { hash, check, file: file as u32, number, line, content: row.content });
        Ok(())
    }

    /// Adds those of a file that continues the ones before.
    pub fn append(&mut self, mut other: Self) {
        if self.keys.is_empty() {
            *self = other;
        } else if !other.keys.is_empty() {
            self.mixed = true;
            self.keys.append(&mut other.keys);
        }
    }

    pub fn keys(&self) -> &[IdFingerprint] {
        &self.keys
    }

    /// A data row with the id of this hash; of several any.
    pub fn find(&mut self, wanted: (u64, u32)) -> Option<u32> {
        let is = |key: &IdFingerprint| (key.hash, key.check) == wanted;
        let near = |from: usize| self.keys.iter().skip(from).take(NEAR).position(is).map(|ahead| from + ahead);
        // From the beginning too: rows are looked for more than once.
        let near = near(self.next).or_else(|| near(0));
        let place = near.or_else(|| {
            self.sort();
            let first = self.sorted.partition_point(|(hash, _)| *hash < wanted.0);
            let same = self.sorted[first..].iter().take_while(|(hash, _)| *hash == wanted.0);
            same.map(|(_, place)| *place as usize).find(|place| is(&self.keys[*place]))
        })?;
        self.next = place + 1;
        Some(self.keys[place].number)
    }

    fn sort(&mut self) {
        if self.sorted.len() != self.keys.len() {
            self.sorted = self.keys.iter().map(|key| key.hash).zip(0..).collect();
            self.sorted.par_sort_unstable();
        }
    }

    /// Hands out the keys of every id that stands more than once, in the order of the files.
    pub fn each_repeated(&mut self, mut take: impl FnMut(&[IdFingerprint])) {
        if !self.mixed {
            return;
        }
        self.sort();
        let mut keys = Vec::new();
        for same in self.sorted.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
            keys.clear();
            keys.extend(same.iter().map(|(_, place)| self.keys[*place as usize]));
            keys.sort_unstable();
            keys.chunk_by(|a, b| a.check == b.check).filter(|keys| keys.len() > 1).for_each(&mut take);
        }
    }

    /// Keeps some keys.
    pub fn retain(&mut self, stays: impl FnMut(&IdFingerprint) -> bool) {
        self.keys.retain(stays);
        (self.sorted, self.next) = (Vec::new(), 0);
    }
}

/// The number of a row, as it is kept of every one.
pub(super) fn narrow(number: u64, label: &str) -> Result<u32> {
    u32::try_from(number).map_err(|_| Error::data(label, "more than 4294967295 rows"))
}
