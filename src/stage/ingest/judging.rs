//! Rows that are taken apart and judged block by block, by threads of their own where a file has many, and handed out in the order of the file.
//!
//! Blocks go to the threads in turn, and the threads are asked in turn: no row depends on how many threads there are.

use super::bind::Binding;
use super::judged::JudgedRows;
use super::record::{HeldRecords, RecordFields, RecordReader};
use super::recorded::RecordedRow;
use super::refusal::RowRefusal;
use super::row::RowReader;
use crate::error::Result;
use std::collections::VecDeque;
use std::mem::take;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{JoinHandle, spawn};

/// Threads that judge the rows of a file at most: whoever takes the rows is the slowest then.
const MOST_THREADS: usize = 4;

type Block = Box<dyn RecordReader>;

/// Hands out the rows of a file as they were judged.
pub(super) struct JudgedFile {
    judge: RowReader,
    /// Blocks that were cut before the first row was asked for.
    cut: VecDeque<Block>,
    /// Until then.
    reader: Option<Block>,
    threads: Option<JudgingThreads>,
    rows: JudgedRows,
}

/// A thread that cuts the file into blocks, and those that judge them.
struct JudgingThreads {
    judges: Vec<JudgingThread>,
    cutter: JoinHandle<()>,
    /// Which of them has the next block.
    turn: usize,
}

struct JudgingThread {
    judged: Receiver<Result<JudgedRows>>,
    /// Rows that were handed out, for their room.
    used: Sender<JudgedRows>,
    handle: JoinHandle<()>,
}

impl JudgedFile {
    /// The rows of a file below its header; `first` is its first row, where that was read to see how wide rows are.
    pub(super) fn new(reader: Block, first: Option<RecordFields>, judge: RowReader) -> Self {
        let mut rows = JudgedRows::default();
        (rows.lines, rows.bytes) = (reader.lines(), reader.bytes());
        let first = first.map(|first| Box::new(HeldRecords::one(first, reader.as_ref())) as Block);
        Self { judge, cut: first.into_iter().collect(), reader: Some(reader), threads: None, rows }
    }
    /// Asks for more hashes of rows than none; before the first row.
    pub(super) fn fingerprint(&mut self, asked: super::fingerprint::Fingerprints) {
        self.judge.asked = asked;
    }
    pub(super) fn binding(&self) -> &Binding {
        &self.judge.binding
    }
    /// Lines of the file up to the block whose rows are handed out; of a file that has no lines its rows.
    pub(super) fn lines(&self) -> u64 {
        self.rows.lines
    }
    pub(super) fn bytes(&self) -> u64 {
        self.rows.bytes
    }
    /// The last row as it stands in the file, for people.
    pub(super) fn shown(&self) -> String {
        self.rows.shown()
    }
    /// Fills `row` with the next row: used or refused; `None` at the end.
    pub(super) fn next(&mut self, row: &mut RecordedRow) -> Result<Option<Result<(), RowRefusal>>> {
        loop {
            if let Some(judged) = self.rows.next(&self.judge.binding, row) {
                row.number += 1;
                return Ok(Some(judged));
            }
            if !self.refill()? {
                return Ok(None);
            }
        }
    }

    /// Whether there is another block.
    fn refill(&mut self) -> Result<bool> {
        if let Some(mut reader) = self.reader.take() {
            self.cut.extend(reader.block(Vec::new())?);
            if let Some(further) = reader.block(Vec::new())? {
                self.cut.push_back(further);
                self.threads = Some(JudgingThreads::new(take(&mut self.cut), reader, &self.judge));
            }
        }
        if let Some(mut threads) = self.threads.take() {
            let Some(judged) = threads.next(&mut self.rows) else { return threads.end().map(|()| false) };
            self.rows = judged?;
            self.threads = Some(threads);
            return Ok(true);
        }
        let Some(block) = self.cut.pop_front() else { return Ok(false) };
        self.judge.block(block, &mut self.rows)?;
        Ok(true)
    }
}

impl JudgingThreads {
    fn new(cut: VecDeque<Block>, reader: Block, judge: &RowReader) -> Self {
        let count = if judge.looks_back() { 1 } else { rayon::current_num_threads().clamp(1, MOST_THREADS) };
        let (free, room) = channel();
        let (blocks, judges) = (0..count).map(|_| JudgingThread::new(judge.clone(), free.clone())).unzip();
        Self { judges, cutter: spawn(move || hand_out(cut, reader, blocks, room)), turn: 0 }
    }

    /// The next block, for the rows of one that was handed out; nothing at the end.
    fn next(&mut self, used: &mut JudgedRows) -> Option<Result<JudgedRows>> {
        let judge = &self.judges[self.turn];
        let judged = judge.judged.recv().ok()?;
        // Where the thread has ended, nobody needs the room.
        let _ = judge.used.send(take(used));
        self.turn = (self.turn + 1) % self.judges.len();
        Some(judged)
    }

    /// Waits for all; a panic of one is resumed here.
    fn end(self) -> Result<()> {
        // Nobody listens any more: all of them end.
        let judges: Vec<JoinHandle<()>> = self.judges.into_iter().map(|judge| judge.handle).collect();
        for thread in [self.cutter].into_iter().chain(judges) {
            thread.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
        Ok(())
    }
}

/// Cuts a file and gives the blocks away in turn, until nobody takes them; `room` is that of blocks that were used.
fn hand_out(cut: VecDeque<Block>, mut reader: Block, to: Vec<SyncSender<Result<Block>>>, room: Receiver<Vec<u8>>) {
    let mut cut = cut.into_iter();
    for thread in to.iter().cycle() {
        let block = cut.next().map(Ok).or_else(|| reader.block(room.try_recv().unwrap_or_default()).transpose());
        let Some(block) = block else { return };
        let is_last = block.is_err();
        if thread.send(block).is_err() || is_last {
            return;
        }
    }
}

impl JudgingThread {
    fn new(mut judge: RowReader, free: Sender<Vec<u8>>) -> (SyncSender<Result<Block>>, Self) {
        let (to, blocks) = sync_channel::<Result<Block>>(1);
        let (full, judged) = sync_channel(1);
        let (used, room) = channel::<JudgedRows>();
        let handle = spawn(move || {
            for block in blocks {
                let mut rows = room.try_recv().unwrap_or_default();
                let judged = block.and_then(|block| judge.block(block, &mut rows)).map(|room| free.send(room));
                if full.send(judged.map(|_| rows)).is_err() {
                    return;
                }
            }
        });
        (to, Self { judged, used, handle })
    }
}
