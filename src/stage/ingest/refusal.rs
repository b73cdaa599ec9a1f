//! Why a row is not used, and the table of such rows, written in chunks where files are read in the order of their names.

use crate::error::Result;
use crate::raw::RecordFault;
use crate::table::{Rejected, RejectedRow, Table};
use crate::units::Unit;
use crate::{Context, Sink, StreamedTable};
use calib_foundation::named;
use std::collections::BTreeMap;

named! {
    /// Why a row is not used; the stable word in the table `rejected`.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub(super) enum Reason {
        Blank "blank",
        NotANumber "not_a_number",
        NotText "not_text",
        ShortRow "short_row",
        LongRow "long_row",
        LostBeam "lost_beam",
        OutOfRange "out_of_range",
        OutOfOrder "out_of_order",
        DuplicateId "duplicate_id",
        DuplicateRow "duplicate_row",
        DoubledStamp "doubled_stamp",
        Foreign "foreign",
        Damaged "damaged",
        Unmatched "unmatched",
    }
}

impl From<RecordFault> for Reason {
    fn from(fault: RecordFault) -> Self {
        match fault {
            RecordFault::Damaged => Self::Damaged,
            RecordFault::Foreign => Self::Foreign,
            RecordFault::DoubledStamp => Self::DoubledStamp,
        }
    }
}

/// A row that is not used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RowRefusal {
    pub reason: Reason,
    pub detail: String,
    /// The setting of a unit, and the unit in which the number is in range.
    pub misread: Option<(&'static str, Unit)>,
}

impl RowRefusal {
    pub(super) fn new(reason: Reason, detail: String) -> Self {
        Self {
            reason,
            detail,
            misread: None,
        }
    }

    /// The row of the table, of the file that tables call `file`.
    pub(super) fn rejected(self, file: &str, line: u64, id: &str, begin: &str) -> RejectedRow {
        RejectedRow {
            file: file.into(),
            line: line as i64,
            point_id: (!id.is_empty()).then(|| id.into()),
            reason: self.reason.name().into(),
            detail: self.detail,
            text: begin.into(),
        }
    }
}

/// Refused rows of a file, from 0.
pub(super) type Refusals = BTreeMap<usize, RowRefusal>;

/// Letters that are shown of a row that is not used.
const SHOWN: usize = 200;

/// How a row begins, for people.
pub(super) fn beginning(row: &[u8]) -> String {
    crate::raw::shown(row).chars().take(SHOWN).collect()
}

/// How many rows were refused for a reason, and the first of them.
#[derive(Debug, Clone)]
pub(super) struct RefusalCount {
    pub rows: u64,
    pub first_line: u64,
    pub first_detail: String,
}

pub(super) type RefusalCounts = BTreeMap<Reason, RefusalCount>;

pub(super) fn tally(counts: &mut RefusalCounts, line: u64, refusal: &RowRefusal) {
    let new = || RefusalCount {
        rows: 0,
        first_line: line,
        first_detail: refusal.detail.clone(),
    };
    counts.entry(refusal.reason).or_insert_with(new).rows += 1;
}

pub(super) fn refuse<T>(reason: Reason, detail: String) -> Result<T, RowRefusal> {
    Err(RowRefusal::new(reason, detail))
}

/// Rejected rows in memory at once, where they come in order.
const REJECTED_CHUNK: usize = 1 << 12;

/// The rejected rows, in the order of the table's key.
pub(super) struct Rejections<'a> {
    sink: Box<dyn Sink + 'a>,
    rows: Vec<RejectedRow>,
    /// The files are read in the order of their names.
    ordered: bool,
}

impl<'a> Rejections<'a> {
    pub(super) fn new(names: &[String], context: &Context<'a>) -> Result<Self> {
        Ok(Self {
            sink: context.services.sink(Rejected::KIND)?,
            rows: Vec::new(),
            ordered: names.is_sorted(),
        })
    }
    pub(super) fn push(&mut self, row: RejectedRow) -> Result<()> {
        let last = self.rows.last();
        let goes_on = last.is_some_and(|last| (&last.file, last.line) == (&row.file, row.line));
        if self.ordered && self.rows.len() >= REJECTED_CHUNK && !goes_on {
            self.flush()?;
        }
        self.rows.push(row);
        Ok(())
    }
    fn flush(&mut self) -> Result<()> {
        self.rows
            .sort_by(|a, b| (&a.file, a.line).cmp(&(&b.file, b.line)));
        // A program may declare several positions in one line.
        self.rows.dedup_by(|next, kept| {
            let same = (&next.file, next.line) == (&kept.file, kept.line);
            if same {
                kept.detail.push_str(&format!("; {}", next.detail));
            }
            same
        });
        self.sink
            .push(Rejected(std::mem::take(&mut self.rows)).to_frame()?)
    }
    pub(super) fn finish(mut self) -> Result<StreamedTable<Rejected>> {
        // Also where nothing was rejected: a table without rows has its columns.
        self.flush()?;
        Ok(StreamedTable::new(self.sink.finish()?))
    }
}
