//! Rows read by a thread of its own, some thousands of them before they are judged.

use super::record::{RecordFields, RecordReader};
use crate::error::Result;
use std::mem::{replace, swap};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::{JoinHandle, spawn};

/// Rows that are handed over at a time, and how many such wait.
const ROWS: usize = 1 << 11;
const WAITING: usize = 2;

/// Rows in the order of the file.
#[derive(Default)]
struct RowBlock {
    /// Kept for their room; the first `count` are rows.
    records: Vec<RecordFields>,
    count: usize,
    /// Of the file up to the last of them.
    lines: u64,
    bytes: u64,
}

/// Hands out what a reader gives.
pub(super) struct Prefetched {
    label: String,
    /// Until the first row is asked for.
    reader: Option<Box<dyn RecordReader>>,
    thread: Option<ReadingThread>,
    block: RowBlock,
    next: usize,
}

struct ReadingThread {
    blocks: Receiver<Result<RowBlock>>,
    /// Blocks whose rows were used.
    used: Sender<RowBlock>,
    handle: JoinHandle<()>,
}

impl Prefetched {
    pub(super) fn new(reader: Box<dyn RecordReader>) -> Self {
        let label = reader.label().to_string();
        Self { label, reader: Some(reader), thread: None, block: RowBlock::default(), next: 0 }
    }

    /// Whether another block came.
    fn refill(&mut self) -> Result<bool> {
        if let Some(reader) = self.reader.take() {
            self.thread = Some(ReadingThread::new(reader));
        }
        let Some(thread) = self.thread.take() else { return Ok(false) };
        match thread.blocks.recv() {
            Ok(block) => {
                // Where the thread has ended, nobody needs the room.
                let _ = thread.used.send(replace(&mut self.block, block?));
                (self.next, self.thread) = (0, Some(thread));
                Ok(true)
            }
            Err(_) => thread.handle.join().map(|()| false).or_else(|panic| std::panic::resume_unwind(panic)),
        }
    }
}

impl ReadingThread {
    fn new(mut reader: Box<dyn RecordReader>) -> Self {
        let (full, blocks) = sync_channel(WAITING);
        let (used, empty) = channel::<RowBlock>();
        let handle = spawn(move || {
            loop {
                let mut block = empty.try_recv().unwrap_or_default();
                let filled = block.fill(reader.as_mut());
                let goes_on = matches!(filled, Ok(true));
                // Nobody listens where a file is given up.
                if full.send(filled.map(|_| block)).is_err() || !goes_on {
                    return;
                }
            }
        });
        Self { blocks, used, handle }
    }
}

impl RowBlock {
    /// Takes rows; false at the end of the file.
    fn fill(&mut self, reader: &mut dyn RecordReader) -> Result<bool> {
        self.records.resize_with(ROWS, RecordFields::default);
        self.count = 0;
        while self.count < ROWS && reader.next(&mut self.records[self.count])? {
            self.count += 1;
        }
        (self.lines, self.bytes) = (reader.lines(), reader.bytes());
        Ok(self.count == ROWS)
    }
}

impl RecordReader for Prefetched {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        while self.next == self.block.count {
            if !self.refill()? {
                return Ok(false);
            }
        }
        swap(record, &mut self.block.records[self.next]);
        self.next += 1;
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.reader.as_ref().map_or(self.block.lines, |reader| reader.lines())
    }
    fn bytes(&self) -> u64 {
        self.reader.as_ref().map_or(self.block.bytes, |reader| reader.bytes())
    }
}
