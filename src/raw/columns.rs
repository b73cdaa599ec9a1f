//! Files of columns (Parquet, Feather, streams of Arrow, arrays of NumPy) as the same records that text gives; they are held in memory.
//!
//! Cells become text: a number of 64 bits comes back the same, and there is one way of judging rows. A list of numbers, as learning data
//! sets hold them, is a column for each: `state[1]`, `state[2]`, and so on.

use super::arrays::{arrays, is_arrays};
use super::record::{Record, RecordReader, failed};
use super::{BatchFile, decoded, parquet};
use crate::error::{Error, Result};
use arrow::array::{
    Array, ArrayRef, AsArray, Int64Array, LargeListArray, RecordBatch, RecordBatchIterator,
    RecordBatchReader,
};
use arrow::compute::{cast, take};
use arrow::datatypes::{DataType, Field, FieldRef, Schema};
use arrow::error::ArrowError;
use arrow::util::display::{ArrayFormatter, FormatOptions};
use arrow_ipc::reader::{FileReader, StreamReader};
use std::fmt::{Display, Write};
use std::io::{Cursor, Read};
use std::ops::Range;
use std::sync::Arc;

/// Rows held as text at a time.
const HELD: usize = 1 << 10;
/// Numbers of a list, at most: a longer one is a picture or a sound.
const LONGEST: usize = 256;
/// How Parquet begins, and Feather of version 1 and of version 2.
const PARQUET: &[u8] = b"PAR1";
const FEATHER: [&[u8]; 2] = [b"FEA1", b"ARROW1"];
/// Bytes that a column of one batch unpacks to, at most.
const MOST_UNPACKED: i64 = 1 << 30;
/// How a stream of Arrow begins: a message of some length follows.
const STREAM: &[u8] = b"\xff\xff\xff\xff";

/// Whether a file that begins so is one of columns.
pub fn has_columns(head: &[u8]) -> bool {
    [PARQUET, FEATHER[0], FEATHER[1], STREAM]
        .iter()
        .any(|mark| head.starts_with(mark))
        || is_arrays(head)
}

/// Reads one file from its names to its last row.
pub struct ColumnRows {
    label: String,
    /// E.g. `a Parquet file`.
    what: &'static str,
    file: BatchFile,
    /// Bytes of the file.
    size: u64,
    is_named: bool,
    batch: Option<RecordBatch>,
    /// The cells of some rows, column by column.
    text: String,
    cells: Vec<Range<usize>>,
    /// How many rows `cells` holds, and the next of them.
    held: usize,
    next: usize,
    rows: u64,
    remark: Option<String>,
}

impl ColumnRows {
    /// Opens a file; fails where it cannot be read.
    pub fn open(mut source: impl Read, label: &str) -> Result<Self> {
        let mut content = Vec::new();
        source
            .read_to_end(&mut content)
            .map_err(|error| failed(label, &error))?;
        let size = content.len() as u64;
        let mut remark = None;
        let (what, opened) = if content.starts_with(PARQUET) {
            let opened = parquet(bytes::Bytes::from(content), HELD);
            ("a Parquet file", opened)
        } else if content.starts_with(FEATHER[0]) {
            let message = "is a Feather file of version 1; allowed: version 2, which every writer of today makes, Parquet or text";
            return Err(Error::data(label, message));
        } else if is_arrays(&content) {
            let table = arrays(content).map(|(table, left)| {
                remark = left;
                let (schema, rows) = (table.schema(), Some(table.num_rows() as u64));
                let file = BatchFile::of(RecordBatchIterator::new([Ok(table)], schema));
                BatchFile { rows, ..file }
            });
            ("an archive of NumPy arrays", table)
        } else if content.starts_with(STREAM) {
            let file = in_memory(content, |content| StreamReader::try_new(content, None));
            ("a stream of Arrow", file)
        } else {
            let file = in_memory(content, |content| FileReader::try_new(content, None));
            ("a Feather file", file)
        };
        let file = unfolded(opened.map_err(|error| broken(label, what, error))?);
        Ok(Self {
            label: label.into(),
            what,
            file,
            size,
            is_named: false,
            batch: None,
            text: String::new(),
            cells: Vec::new(),
            held: 0,
            next: 0,
            rows: 0,
            remark,
        })
    }
    /// Makes text of the next rows; false at the end.
    fn refill(&mut self) -> Result<bool> {
        let broken = |error: &dyn Display| broken(&self.label, self.what, error);
        let batch = match self.batch.take() {
            Some(batch) => batch,
            None => match self.file.next() {
                Some(batch) => batch.map_err(|error| broken(&error))?,
                None => return Ok(false),
            },
        };
        (self.held, self.next) = (batch.num_rows().min(HELD), 0);
        self.text.clear();
        self.cells.clear();
        for column in batch.columns() {
            let cells = ArrayFormatter::try_new(column, &FormatOptions::default())
                .map_err(|error| broken(&error))?;
            for row in 0..self.held {
                let start = self.text.len();
                write!(self.text, "{}", cells.value(row)).map_err(|error| broken(&error))?;
                self.cells.push(start..self.text.len());
            }
        }
        let left = batch.num_rows() - self.held;
        self.batch = (left > 0).then(|| batch.slice(self.held, left));
        Ok(true)
    }
}

impl RecordReader for ColumnRows {
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        record.begin(self.rows);
        if !std::mem::replace(&mut self.is_named, true) {
            self.file
                .schema
                .fields()
                .iter()
                .for_each(|field| record.push(field.name().as_bytes()));
            return Ok(true);
        }
        while self.next == self.held {
            if !self.refill()? {
                return Ok(false);
            }
        }
        self.rows += 1;
        record.begin(self.rows);
        let cells = self.cells.iter().skip(self.next).step_by(self.held);
        cells.for_each(|cell| record.push(self.text[cell.clone()].as_bytes()));
        self.next += 1;
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.rows
    }
    fn remark(&self) -> Option<String> {
        self.remark.clone()
    }
    /// Progress as a part of the file.
    fn bytes(&self) -> u64 {
        let all = self.file.rows.unwrap_or_default().max(1);
        (u128::from(self.size) * u128::from(self.rows.min(all)) / u128::from(all)) as u64
    }
}

/// The fault of a file whose decoder gives up.
fn broken(label: &str, what: &str, error: impl Display) -> Error {
    Error::data(label, format!("is {what} that cannot be read: {error}"))
}

/// Refuses messages of Arrow whose columns unpack to more than may be: the decoder asks for that memory unseen, and ends the program where it
/// is not granted. What else is wrong is the decoder's to say.
fn bounded(content: &[u8]) -> std::result::Result<(), String> {
    // The end of a file says where its messages and their columns begin; those of a stream follow each other.
    for (at, body) in blocks(content).unwrap_or_default() {
        if let Some((message, _)) = message(content, at) {
            unpacks(content, &message, body)?;
        }
    }
    let first = content.chunks(8).position(|at| at.starts_with(STREAM));
    let mut at = 8 * first.unwrap_or(content.len());
    while let Some((message, body)) = message(content, at) {
        unpacks(content, &message, body)?;
        at = beyond(body, message.bodyLength());
    }
    Ok(())
}

/// Where the messages of a Feather file and their columns begin; none where its end is not one.
fn blocks(content: &[u8]) -> Option<Vec<(usize, usize)>> {
    let (head, length) = content.strip_suffix(FEATHER[1])?.split_last_chunk()?;
    let first = head
        .len()
        .checked_sub(u32::from_le_bytes(*length) as usize)?;
    let footer = arrow_ipc::root_as_footer(head.get(first..)?).ok()?;
    let blocks = [footer.dictionaries(), footer.recordBatches()];
    let place = |block: &arrow_ipc::Block| {
        let at = beyond(0, block.offset());
        (at, beyond(at, block.metaDataLength().into()))
    };
    Some(blocks.iter().flatten().flatten().map(place).collect())
}

/// Refuses a message whose columns, which begin at `body`, unpack to more than may be.
fn unpacks(
    content: &[u8],
    message: &arrow_ipc::Message<'_>,
    body: usize,
) -> std::result::Result<(), String> {
    let batch = message.header_as_record_batch().or_else(|| {
        let dictionary = message.header_as_dictionary_batch();
        dictionary.and_then(|dictionary| dictionary.data())
    });
    let packed = batch.filter(|batch| batch.compression().is_some());
    for buffer in packed.iter().filter_map(|batch| batch.buffers()).flatten() {
        let stated = content.get(beyond(body, buffer.offset())..);
        let stated = stated
            .and_then(<[u8]>::first_chunk)
            .filter(|_| buffer.length() > 0);
        let bytes = stated.map_or(0, |bytes| i64::from_le_bytes(*bytes));
        // -1: it is not packed.
        if !(-1..=MOST_UNPACKED).contains(&bytes) {
            return Err(format!(
                "a column unpacks to {bytes} bytes; allowed: {} GB a batch",
                MOST_UNPACKED >> 30
            ));
        }
    }
    Ok(())
}

/// A place beyond another, the end of everything if it is none.
fn beyond(at: usize, by: i64) -> usize {
    at.saturating_add(usize::try_from(by).unwrap_or(usize::MAX))
}

/// The message of Arrow that begins at a place, and where its columns begin.
fn message(content: &[u8], at: usize) -> Option<(arrow_ipc::Message<'_>, usize)> {
    let length = content.get(at..)?.strip_prefix(STREAM)?.first_chunk()?;
    let head = at + 2 * STREAM.len();
    let body = head.checked_add(u32::from_le_bytes(*length) as usize)?;
    let message = arrow_ipc::root_as_message(content.get(head..body)?).ok()?;
    Some((message, body))
}

/// Columns of Arrow as they stand in memory, in a Feather file, as pandas, polars and R write them, or in a stream; uncompressed or by zstd.
fn in_memory<R: RecordBatchReader + Send + 'static>(
    content: Vec<u8>,
    open: impl FnOnce(Cursor<Vec<u8>>) -> std::result::Result<R, ArrowError>,
) -> std::result::Result<BatchFile, String> {
    const LZ4: &str = "its columns are compressed by LZ4; allowed: none or zstd, e.g. `to_feather(FILE, compression=\"zstd\")`";
    bounded(&content)?;
    let opened = decoded(|| open(Cursor::new(content)))?;
    let file = BatchFile::of(opened.map_err(|error| error.to_string())?);
    let advised = |message: String| match message.contains("lz4") {
        true => LZ4.into(),
        false => message,
    };
    let batches = file.batches.map(move |batch| batch.map_err(advised));
    Ok(BatchFile {
        batches: Box::new(batches),
        ..file
    })
}

/// The same with lists of numbers as columns, as many as the longest list of the first rows has; a shorter list has blank cells.
fn unfolded(mut file: BatchFile) -> BatchFile {
    let fields = file.schema.fields().clone();
    let numbers: Vec<Option<DataType>> = fields.iter().map(number_of_list).collect();
    if numbers.iter().all(Option::is_none) {
        return file;
    }
    let first = file.next();
    // Of a list of numbers its kind of numbers, and how many columns it becomes.
    let longest = |column: usize, number: &DataType| {
        let rows = first.as_ref()?.as_ref().ok()?;
        let lists = lists(rows.column(column), number).ok()?;
        let lengths = lists
            .value_offsets()
            .windows(2)
            .map(|ends| ends[1] - ends[0]);
        lengths.max().map(|longest| longest as usize)
    };
    let wide = |(column, number): (usize, Option<DataType>)| {
        let number = number?;
        let width = longest(column, &number)?;
        (1..=LONGEST).contains(&width).then_some((number, width))
    };
    let wide: Vec<Option<(DataType, usize)>> = numbers.into_iter().enumerate().map(wide).collect();
    let columns = fields.iter().zip(&wide);
    let columns = columns.flat_map(|(field, wide)| match wide {
        None => vec![field.clone()],
        Some((number, width)) => {
            let named = |k| Field::new(format!("{}[{k}]", field.name()), number.clone(), true);
            (1..=*width).map(|k| Arc::new(named(k))).collect()
        }
    });
    let schema = Arc::new(Schema::new(columns.collect::<Vec<FieldRef>>()));
    let unfolded = schema.clone();
    let batches = first.into_iter().chain(file.batches).map(move |batch| {
        let batch = batch?;
        let columns = batch.columns().iter().zip(&wide);
        let columns = columns.map(|(column, wide)| match wide {
            None => Ok(vec![column.clone()]),
            Some((number, width)) => cells(column, number, *width),
        });
        let columns = columns.collect::<std::result::Result<Vec<_>, _>>();
        columns
            .and_then(|columns| RecordBatch::try_new(unfolded.clone(), columns.concat()))
            .map_err(|error| error.to_string())
    });
    BatchFile {
        schema,
        rows: file.rows,
        batches: Box::new(batches),
    }
}

/// What kind of numbers the lists of a column hold; none where it holds none.
fn number_of_list(field: &FieldRef) -> Option<DataType> {
    let (DataType::List(item) | DataType::LargeList(item) | DataType::FixedSizeList(item, _)) =
        field.data_type()
    else {
        return None;
    };
    Some(item.data_type().clone()).filter(DataType::is_numeric)
}

fn lists(column: &ArrayRef, number: &DataType) -> std::result::Result<LargeListArray, ArrowError> {
    let field = Arc::new(Field::new_list_field(number.clone(), true));
    cast(column, &DataType::LargeList(field)).map(|lists| lists.as_list().clone())
}

/// The numbers of the lists of a column as so many columns.
fn cells(
    column: &ArrayRef,
    number: &DataType,
    width: usize,
) -> std::result::Result<Vec<ArrayRef>, ArrowError> {
    let lists = lists(column, number)?;
    let starts = lists.value_offsets();
    let numbers = |k: i64| {
        let at = |row: usize| {
            let is_there = starts[row] + k < starts[row + 1] && !lists.is_null(row);
            is_there.then_some(starts[row] + k)
        };
        let at: Int64Array = (0..lists.len()).map(at).collect();
        take(lists.values(), &at, None)
    };
    (0..width as i64).map(numbers).collect()
}
