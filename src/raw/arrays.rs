//! Arrays of NumPy (.npz) as columns: those of as many rows as the longest has, an array of two dimensions as a column for each number of a row.

use super::decoded;
use crate::error::listed;
use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use std::io::{Cursor, Read};
use std::sync::Arc;

/// How an array begins, and its bytes at most.
const MAGIC: &[u8] = b"\x93NUMPY";
const MOST_BYTES: u64 = 1 << 30;
/// Numbers of a row, and letters of a text, at most.
const WIDEST: usize = 256;
const LONGEST: usize = 1 << 12;

/// Whether a file that begins so is an archive of arrays: its first entry is called so.
pub(super) fn is_arrays(head: &[u8]) -> bool {
    let length = head.get(26..28).and_then(count).unwrap_or_default();
    let name = head.get(30..30 + length);
    head.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(b".npy"))
}

struct PlainArray {
    name: String,
    rows: usize,
    /// Each with its name, and that its cells may be blank.
    columns: Vec<(String, ArrayRef, bool)>,
}

/// The arrays as one table, and what was left out.
pub(super) fn arrays(content: Vec<u8>) -> Result<(RecordBatch, Option<String>), String> {
    let found = decoded(|| entries(content))??;
    let rows = found.iter().map(|array| array.rows).max();
    let rows = rows.unwrap_or_default();
    let (used, left): (Vec<PlainArray>, Vec<PlainArray>) = found
        .into_iter()
        .partition(|array| array.rows == rows && rows > 0);
    let columns: Vec<_> = used.into_iter().flat_map(|array| array.columns).collect();
    if columns.is_empty() {
        return Err("it has no array of numbers or texts in rows".into());
    }
    let table = RecordBatch::try_from_iter_with_nullable(columns);
    let remark = (!left.is_empty()).then(|| {
        let left = left
            .iter()
            .map(|array| format!("`{}` ({} rows)", array.name, array.rows));
        format!(
            "arrays of another length than {rows} left out: {}",
            listed(left)
        )
    });
    Ok((table.map_err(|error| error.to_string())?, remark))
}

fn entries(content: Vec<u8>) -> Result<Vec<PlainArray>, String> {
    let broken = |error: zip::result::ZipError| error.to_string();
    let mut archive = zip::ZipArchive::new(Cursor::new(content)).map_err(broken)?;
    let (mut left, mut found) = (MOST_BYTES, Vec::new());
    for index in 0..archive.len() {
        let part = archive.by_index(index).map_err(broken)?;
        let name = part
            .name()
            .map_err(broken)?
            .trim_end_matches(".npy")
            .to_string();
        let mut bytes = Vec::new();
        part.take(left + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| error.to_string())?;
        left = left
            .checked_sub(bytes.len() as u64)
            .ok_or(format!("more than {} MB of arrays", MOST_BYTES >> 20))?;
        found.push(array(name.clone(), &bytes).map_err(|why| format!("array `{name}`: {why}"))?);
    }
    Ok(found)
}

/// The text behind a key of the head, up to where its value ends.
fn value<'h>(head: &'h str, key: &str, ends: char) -> Option<&'h str> {
    let (_, tail) = head.split_once(&format!("'{key}':"))?;
    Some(tail[..tail.find(ends)? + 1].trim())
}

fn array(name: String, bytes: &[u8]) -> Result<PlainArray, String> {
    const BROKEN: &str = "its head is damaged";
    let version = bytes
        .strip_prefix(MAGIC)
        .and_then(|tail| tail.first())
        .ok_or(BROKEN)?;
    let from = if *version == 1 { 10 } else { 12 };
    let end = bytes.get(8..from).and_then(count).ok_or(BROKEN)? + from;
    let head = String::from_utf8_lossy(bytes.get(from..end).ok_or(BROKEN)?).into_owned();
    let kind = value(&head, "descr", ',')
        .map(|text| text.trim_matches([',', '\'', ' ']))
        .ok_or(BROKEN)?;
    let by_column = value(&head, "fortran_order", ',')
        .ok_or(BROKEN)?
        .starts_with("True");
    let shape = value(&head, "shape", ')')
        .ok_or(BROKEN)?
        .trim_matches(['(', ')']);
    let shape: Option<Vec<usize>> = shape
        .split(',')
        .map(str::trim)
        .filter(|size| !size.is_empty())
        .map(|size| size.parse().ok())
        .collect();
    let (rows, width, is_plain) = match shape.ok_or(BROKEN)?[..] {
        [] => (0, 0, true),
        [rows] => (rows, 1, true),
        [rows, width] if width <= WIDEST => (rows, width, false),
        // Pictures and the like are no columns.
        [rows, ..] => (rows, 0, false),
    };
    let unread = || format!("type {kind} is not read; allowed: numbers and texts");
    let mut letters = kind.chars();
    let parts = (letters.next(), letters.next(), letters.as_str().parse());
    let (Some(order), Some(code), Ok(size @ 1..=LONGEST)) = parts else {
        return Err(unread());
    };
    let size = if code == 'U' { 4 * size } else { size };
    let data = &bytes[end..];
    let stated = rows
        .checked_mul(width)
        .and_then(|cells| cells.checked_mul(size));
    if width > 0 && stated != Some(data.len()) {
        return Err(format!("{} bytes for {rows} rows of {width}", data.len()));
    }
    let cell = |row: usize, column: usize| {
        let at = if by_column {
            column * rows + row
        } else {
            row * width + column
        };
        let mut item = data[at * size..(at + 1) * size].to_vec();
        if order == '>' {
            item.chunks_mut(if code == 'U' { 4 } else { size })
                .for_each(<[u8]>::reverse);
        }
        item
    };
    let double = |item: Vec<u8>| item.first_chunk().map(|eight| f64::from_le_bytes(*eight));
    let single = |item: Vec<u8>| {
        let four = item.first_chunk()?;
        Some(f64::from(f32::from_le_bytes(*four)))
    };
    let integer = |item: Vec<u8>| whole(&item, code == 'i');
    let text = |item: Vec<u8>| -> Option<String> {
        let codes = item.chunks_exact(4).filter_map(<[u8]>::first_chunk);
        let codes = codes.map(|four| u32::from_le_bytes(*four));
        codes
            .take_while(|code| *code != 0)
            .map(char::from_u32)
            .collect()
    };
    let column = |column: usize| -> Result<(String, ArrayRef, bool), String> {
        let cells = (0..rows).map(|row| cell(row, column));
        let column_name = match is_plain {
            true => name.clone(),
            false => format!("{name}[{}]", column + 1),
        };
        let values: ArrayRef = match (code, size) {
            ('f', 8) => Arc::new(cells.map(double).collect::<Float64Array>()),
            ('f', 4) => Arc::new(cells.map(single).collect::<Float64Array>()),
            ('i' | 'u' | 'b', 1 | 2 | 4 | 8) => {
                Arc::new(cells.map(integer).collect::<Int64Array>())
            }
            ('U', _) => Arc::new(cells.map(text).collect::<StringArray>()),
            _ => return Err(unread()),
        };
        Ok((column_name, values, true))
    };
    let columns = (0..width).map(column).collect::<Result<_, _>>()?;
    Ok(PlainArray {
        name,
        rows,
        columns,
    })
}

/// A whole number of up to eight bytes; none beyond those of 64 bits with a sign.
fn whole(bytes: &[u8], signed: bool) -> Option<i64> {
    let number = bytes
        .iter()
        .rev()
        .fold(0u64, |number, byte| number << 8 | u64::from(*byte));
    let unused = 64 - 8 * bytes.len() as u32;
    if signed {
        Some(((number << unused) as i64) >> unused)
    } else {
        i64::try_from(number).ok()
    }
}

fn count(bytes: &[u8]) -> Option<usize> {
    usize::try_from(whole(bytes, false)?).ok()
}
