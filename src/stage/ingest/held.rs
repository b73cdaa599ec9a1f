//! Rows of a file as they were judged, in columns: handed out again to be written, and found by number as partners of other rows.
//!
//! A file that takes more memory than it may is read again instead; what partners need of it is held all the same.

use super::bind::Binding;
use super::reading::OpenedFile;
use super::recorded::RecordedRow;
use super::refusal::RowRefusal;

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
    pub(super) fn len(&self) -> usize {
        self.ends.len()
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
    pub places: Vec<usize>,
    /// Their values, row by row.
    pub values: Vec<f64>,
    /// The points of wide rows, of so many targets each.
    pub points: Vec<[f64; 3]>,
    targets: usize,
    pub ids: Texts,
    /// Places of a row's texts that the file has, and the texts of each.
    texts: Vec<(usize, Texts)>,
    /// What only the file's own rows need; given up where it is too much.
    own: Option<OwnRows>,
    /// Whether rows of another file look for partners here.
    has_partners: bool,
    /// Bytes of memory that may be taken.
    most: usize,
}

#[derive(Default)]
struct OwnRows {
    lines: Vec<u64>,
    /// Where the file says it.
    sequence: Vec<i64>,
    /// As they stand in the file.
    records: Texts,
    /// By index.
    refused: Vec<(usize, RowRefusal)>,
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
            own: Some(OwnRows::default()),
            has_partners,
            most,
            ..Self::default()
        }
    }

    /// Takes the present row of a file.
    pub(super) fn push(&mut self, open: &OpenedFile, judged: &Result<(), RowRefusal>) {
        if self.own.is_none() && !self.has_partners {
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
        let Some(own) = &mut self.own else { return };
        own.lines.push(row.line);
        if open.binding().sequence.is_some() {
            own.sequence.push(row.sequence.unwrap_or(i64::MIN));
        }
        own.records.push(open.text());
        own.refused.extend(
            judged
                .as_ref()
                .err()
                .map(|refusal| (own.lines.len() - 1, refusal.clone())),
        );
        let texts: usize = self.texts.iter().map(|(_, texts)| texts.size()).sum();
        let refused = own.refused.len() * 128 + own.records.size() + 16 * own.lines.len();
        if 8 * self.values.len() + 24 * self.points.len() + self.ids.size() + texts + refused
            > self.most
        {
            self.own = None;
            if !self.has_partners {
                *self = Self::default();
            }
        }
    }

    /// The text of a row in this place of its texts.
    pub(super) fn text(&self, place: usize, at: usize) -> Option<&str> {
        self.texts.iter().find(|(own, _)| *own == place)?.1.get(at)
    }

    /// The rows; none where the file must be read again.
    pub(super) fn rows(&self, row: RecordedRow) -> Option<HeldReading<'_>> {
        Some(HeldReading {
            held: self,
            own: self.own.as_ref()?,
            refused: 0,
            row,
        })
    }
}

/// Hands out the rows of a file.
pub(super) struct HeldReading<'a> {
    held: &'a HeldRows,
    own: &'a OwnRows,
    /// Refusals handed out.
    refused: usize,
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
                .own
                .records
                .bytes(held.row.number as usize - 1)
                .unwrap_or_default(),
            Self::File(open) => open.text(),
        }
    }
    /// Goes on to the next row: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> crate::error::Result<Option<Result<(), RowRefusal>>> {
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
        row.line = *self.own.lines.get(at)?;
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
            .own
            .sequence
            .get(at)
            .copied()
            .filter(|number| *number != i64::MIN);
        let refusal = self
            .own
            .refused
            .get(self.refused)
            .filter(|(index, _)| *index == at);
        self.refused += usize::from(refusal.is_some());
        Some(refusal.map_or(Ok(()), |(_, refusal)| Err(refusal.clone())))
    }
}
