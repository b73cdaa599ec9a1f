//! Reading and writing at once: rows go to the table while they are read, as if each of them were used with its partner. Where that turns
//! out to be so, the files that lead need no second reading.
//!
//! The files beside the first of a join are read before it, so that a row's partners are known when it comes. What only the whole file
//! tells (a point id that stands twice, the nearest in time, velocities) leads to a second reading.

use super::Ingest;
use super::arm::RobotJoints;
use super::joined::JoinDecisions;
use super::layout::{Duplicates, Join};
use super::pair::{FileDecision, NONE};
use super::reading::OpenedFile;
use super::recorded::RecordedRow;
use super::refusal::RowRefusal;
use super::rejections::Rejections;
use super::scan::{self, Scan};
use super::verdict;
use super::write::{self, RecordingChunks};
use crate::error::Result;
use crate::stage::{Context, StreamedTable};
use crate::table::{Recording, Rejected, RejectedRow};
use std::sync::Arc;

/// Rejected rows that are held until it is clear that no second reading is needed; with more of them one is.
const MOST_REJECTED: usize = 1 << 15;

/// What was written while files were read.
pub(super) struct WrittenAhead<'a> {
    chunks: RecordingChunks<'a>,
    /// By file.
    rejected: Vec<Vec<RejectedRow>>,
}

/// Reads the files of a measurement; rows are written meanwhile where `alone`: no other measurement follows.
pub(super) fn read<'a>(
    settings: &Ingest,
    arm: &Arc<RobotJoints>,
    alone: bool,
    context: &Context<'a>,
) -> Result<(Vec<Scan>, Option<WrittenAhead<'a>>)> {
    let opened = |layout| scan::open(settings, layout, arm, context);
    let mut files = settings.files.iter().map(opened).collect::<Result<Vec<_>>>()?;
    let leading = if is_joined(settings) { 1 } else { files.len() };
    let scans = files.iter().map(scan::ScannedFile::beginning).collect();
    let mut ahead = Ahead::new(settings, arm, leading, scans, context, alone && may_be_used_as_they_come(settings))?;
    // Partners before those that look for them; from the end, since each file is closed when it was read.
    let first: Vec<usize> = (leading..files.len()).collect();
    let order: Vec<usize> =
        if ahead.chunks.is_some() { first.into_iter().chain(0..leading).collect() } else { (0..files.len()).collect() };
    let mut files: Vec<Option<scan::ScannedFile>> = files.drain(..).map(Some).collect();
    for index in order {
        let Some(file) = files[index].take() else { continue };
        let scan = scan::scan(settings, index, file, arm, context, &mut |open, judged| ahead.take(index, open, judged))?;
        ahead.end_file(index, scan);
    }
    let written = ahead.chunks.map(|chunks| WrittenAhead { chunks, rejected: ahead.rejected });
    Ok((ahead.scans, written))
}

impl WrittenAhead<'_> {
    /// Whether the rows of the files that lead are used as they were written.
    pub(super) fn stands(&self, decisions: &[FileDecision]) -> bool {
        decisions.iter().all(|decision| decision.twins.is_empty())
    }

    /// Ends the tables. A file beside the first of a join is read again where rows of it have no partner.
    pub(super) fn finish(
        self,
        one: &JoinDecisions,
        context: &Context,
    ) -> Result<(StreamedTable<Recording>, StreamedTable<Rejected>)> {
        let mut rejected = Rejections::new(one.names, context)?;
        for (index, (rows, layout)) in self.rejected.into_iter().zip(&one.settings.files).enumerate() {
            let (scan, decision) = (&one.scans[index], &one.decisions[index]);
            if index < one.leading() || verdict::accepted(scan, decision) == scan.used() {
                rows.into_iter().try_for_each(|row| rejected.push(row))?;
            } else {
                write::file(one, index, layout, None, &mut rejected, context)?;
            }
        }
        Ok((self.chunks.finish(context)?, rejected.finish()?))
    }
}

fn is_joined(settings: &Ingest) -> bool {
    matches!(settings.join, Some(Join::Id {} | Join::Time { .. } | Join::Order {}))
}

/// Whether no row waits for a later one: neither for its velocity nor for the nearest in time.
fn may_be_used_as_they_come(settings: &Ingest) -> bool {
    let by_id = matches!(settings.join, Some(Join::Id {}));
    settings.motion.is_none()
        && !matches!(settings.join, Some(Join::Time { .. }))
        && !(by_id && settings.duplicates == Duplicates::Keep)
}

/// Rows on their way to the table.
struct Ahead<'a, 'b> {
    settings: &'b Ingest,
    arm: &'b Arc<RobotJoints>,
    leading: usize,
    scans: Vec<Scan>,
    /// The decision on the file that is read: partners as far as it was read.
    decision: FileDecision,
    names: Vec<String>,
    chunks: Option<RecordingChunks<'a>>,
    rejected: Vec<Vec<RejectedRow>>,
}

impl<'a, 'b> Ahead<'a, 'b> {
    fn new(
        settings: &'b Ingest,
        arm: &'b Arc<RobotJoints>,
        leading: usize,
        scans: Vec<Scan>,
        context: &Context<'a>,
        writes: bool,
    ) -> Result<Self> {
        let names = super::names(scans.iter().map(|scan| scan.label.as_str()));
        let decided = JoinDecisions { settings, arm, scans: &scans, decisions: &[], names: &names };
        let chunks = if writes { Some(RecordingChunks::new(&[decided], context)?) } else { None };
        let rejected = scans.iter().map(|_| Vec::new()).collect();
        Ok(Self { settings, arm, leading, scans, decision: FileDecision::default(), names, chunks, rejected })
    }

    /// Takes a row of a file; what is no longer of use is given up.
    fn take(&mut self, index: usize, open: &OpenedFile, judged: &Result<(), RowRefusal>) {
        if self.chunks.is_none() {
            return;
        }
        let row = &open.row;
        if let Err(refusal) = judged {
            self.reject(index, open, refusal.clone());
        }
        if index >= self.leading {
            return;
        }
        if is_joined(self.settings) {
            self.partner(row, judged.is_ok());
        }
        if judged.is_err() {
            return;
        }
        let decisions = std::slice::from_ref(&self.decision);
        let decided = JoinDecisions { settings: self.settings, arm: self.arm, scans: &self.scans, decisions, names: &self.names };
        match decided.outcome(index, &self.decision, row) {
            Ok(()) => {
                let pushed = self.chunks.as_mut().map(|chunks| chunks.push(row, index, &self.decision, &decided));
                // Said by the second reading, after what is wrong with the files as a whole.
                if pushed.is_some_and(|pushed| pushed.is_err()) {
                    self.chunks = None;
                }
            }
            Err(refusal) => self.reject(index, open, refusal),
        }
    }

    fn reject(&mut self, index: usize, open: &OpenedFile, refusal: RowRefusal) {
        self.rejected[index].push(open.rejected(&self.names[index], refusal));
        if self.rejected.iter().map(Vec::len).sum::<usize>() > MOST_REJECTED {
            self.chunks = None;
            self.rejected.iter_mut().for_each(|rows| *rows = Vec::new());
        }
    }

    /// The partners of a row of the first file in the others.
    fn partner(&mut self, row: &RecordedRow, usable: bool) {
        self.decision.partners.resize_with(self.scans.len() - 1, Vec::new);
        for (partners, other) in self.decision.partners.iter_mut().zip(&mut self.scans[1..]) {
            let partner = match &self.settings.join {
                Some(Join::Id {}) if usable && !row.id.is_empty() => other.ids.find(row.key),
                Some(Join::Order {}) if usable && other.usable.get(row.number as usize - 1) == Some(&true) => {
                    Some(row.number as u32)
                }
                _ => None,
            };
            partners.push(partner.unwrap_or(NONE));
        }
    }

    fn end_file(&mut self, index: usize, scan: Scan) {
        if let Some(chunks) = self.chunks.as_mut().filter(|_| index < self.leading) {
            chunks.before += scan.read;
        }
        self.decision = FileDecision::default();
        self.scans[index] = scan;
    }
}
