//! The table of rejected rows, written in chunks where files are read in the order of their names.

use crate::error::Result;
use crate::stage::{Context, Sink, StreamedTable};
use crate::table::{Rejected, RejectedRow, Table};

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
        let goes_on = self
            .rows
            .last()
            .is_some_and(|last| (&last.file, last.line) == (&row.file, row.line));
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
