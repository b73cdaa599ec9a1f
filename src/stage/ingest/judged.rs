//! Rows of a block as they were judged, in the order of the file: numbers row by row, texts one behind the other, no row with room of its own.

use super::bind::Binding;
use super::encoding;
use super::record::RecordFields;
use super::recorded::RecordedRow;
use super::refusal::RowRefusal;
use std::collections::VecDeque;
use std::iter::repeat_n;

/// Takes rows, and gives them back from the first.
#[derive(Default)]
pub(super) struct JudgedRows {
    rows: Vec<KeptRow>,
    /// The numbers of each row that the file fills.
    values: Vec<f64>,
    points: Vec<[f64; 3]>,
    /// The id of each row, then its texts that the file has.
    texts: String,
    ends: Vec<usize>,
    /// The rows as they stand in the file.
    records: Vec<u8>,
    refusals: VecDeque<RowRefusal>,
    rarities: VecDeque<Rarities>,
    /// How many were given back.
    given: usize,
    /// Lines and bytes of the file up to the last of these rows.
    pub lines: u64,
    pub bytes: u64,
}

/// What every row has.
struct KeptRow {
    line: u64,
    key: (u64, u32),
    content: u64,
    /// Where it ends among `records`.
    record_end: usize,
    is_refused: bool,
    is_blank: bool,
    is_rare: bool,
}

/// What hardly any row has.
struct Rarities {
    sequence: Option<i64>,
    beyond: Option<usize>,
    turned: Option<(usize, f64)>,
}

impl JudgedRows {
    /// Forgets all rows, but not the room for them.
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.values.clear();
        self.points.clear();
        self.texts.clear();
        self.ends.clear();
        self.records.clear();
        self.refusals.clear();
        self.rarities.clear();
        self.given = 0;
    }

    /// Takes a row as it was judged.
    pub(super) fn push(&mut self, binding: &Binding, record: &RecordFields, row: &RecordedRow, judged: Result<(), RowRefusal>) {
        self.values.extend(binding.filled.iter().map(|place| row.values[*place]));
        let lacking = binding.points.len() - row.points.len();
        self.points.extend(row.points.iter().copied().chain(repeat_n([f64::NAN; 3], lacking)));
        self.texts.push_str(&row.id);
        self.ends.push(self.texts.len());
        for place in &binding.worded {
            self.texts.push_str(&row.texts[*place]);
            self.ends.push(self.texts.len());
        }
        self.records.extend_from_slice(&record.text);
        let rarities = Rarities { sequence: row.sequence, beyond: row.beyond, turned: row.turned };
        let is_rare = rarities.sequence.is_some() || rarities.beyond.is_some() || rarities.turned.is_some();
        self.rows.push(KeptRow {
            line: row.line,
            key: row.key,
            content: row.content,
            record_end: self.records.len(),
            is_refused: judged.is_err(),
            is_blank: row.is_blank,
            is_rare,
        });
        if is_rare {
            self.rarities.push_back(rarities);
        }
        self.refusals.extend(judged.err());
    }

    /// Gives back the next row; nothing behind the last.
    pub(super) fn next(&mut self, binding: &Binding, row: &mut RecordedRow) -> Option<Result<(), RowRefusal>> {
        let own = self.rows.get(self.given)?;
        let (at, width) = (self.given, binding.filled.len());
        for (place, value) in binding.filled.iter().zip(&self.values[at * width..]) {
            row.values[*place] = *value;
        }
        let targets = binding.points.len();
        row.points.clear();
        row.points.extend_from_slice(&self.points[at * targets..(at + 1) * targets]);
        let first = at * (1 + binding.worded.len());
        let text = |k: usize| &self.texts[k.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[k]];
        row.id.clear();
        row.id.push_str(text(first));
        for (place, k) in binding.worded.iter().zip(first + 1..) {
            row.texts[*place].clear();
            row.texts[*place].push_str(text(k));
        }
        let rarities = if own.is_rare { self.rarities.pop_front() } else { None };
        (row.sequence, row.beyond, row.turned) =
            rarities.map_or((None, None, None), |some| (some.sequence, some.beyond, some.turned));
        (row.line, row.key, row.content, row.is_blank) = (own.line, own.key, own.content, own.is_blank);
        self.given += 1;
        let refusal = if own.is_refused { self.refusals.pop_front() } else { None };
        Some(refusal.map_or(Ok(()), Err))
    }

    /// The row that was given back last as it stands in the file, for people, cut at 200 characters.
    pub(super) fn shown(&self) -> String {
        let end = |row: Option<usize>| row.and_then(|row| self.rows.get(row)).map_or(0, |row| row.record_end);
        let record = &self.records[end(self.given.checked_sub(2))..end(self.given.checked_sub(1))];
        encoding::shown(record).chars().take(200).collect()
    }
}
