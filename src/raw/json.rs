//! JSON as records: a list of objects, an object with such a list in it, or an object a line; what an object holds in a list or an object of its
//! own is a column for each, `state[1]`, `pose.x`.

use super::record::{Record, RecordReader};
use super::{decoded_text, failed};
use crate::error::{Error, Result, listed};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Read;

/// Bytes of a file at most.
const MOST_BYTES: u64 = 1 << 30;
/// Numbers of a list in a row at most.
const WIDEST: usize = 256;

/// Whether a file that begins so holds objects.
pub fn is_json(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let begins = |text: &[u8], mark: u8| text.trim_ascii_start().first() == Some(&mark);
    let inside = |text: &'_ [u8]| text.trim_ascii_start()[1..].to_vec();
    let object = |text: &[u8]| begins(text, b'{') && begins(&inside(text), b'"');
    object(head) || (begins(head, b'[') && object(&inside(head)))
}

/// The objects of a file, row by row.
pub struct JsonRows {
    names: Vec<String>,
    /// Each with its line, of a file with an object a line.
    rows: Vec<(u64, BTreeMap<String, String>)>,
    /// How many were handed out, the header first.
    next: usize,
    remark: Option<String>,
}

impl JsonRows {
    /// Reads a file from first byte to last.
    ///
    /// # Errors
    /// [`Error::Data`] with the line where it is no JSON, or holds no objects in rows.
    pub fn open(source: impl Read, label: &str) -> Result<Self> {
        let mut bytes = Vec::new();
        let read = source.take(MOST_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|error| failed(label, &error))?;
        if bytes.len() as u64 > MOST_BYTES {
            let message = format!(
                "more than {} MB of JSON; allowed: an object a line in several files, or a text with commas",
                MOST_BYTES >> 20
            );
            return Err(Error::data(label, message));
        }
        let text = decoded_text(&bytes)
            .ok_or_else(|| Error::data(label, "is neither UTF-8 nor Windows-1252 text"))?;
        let text = text.trim_start_matches('\u{feff}');
        let (objects, remark) = match serde_json::from_str::<Value>(text) {
            Ok(whole) => objects(whole).map_err(|message| Error::data(label, message))?,
            Err(error) => match lines(text) {
                Ok(all) => (all, None),
                Err((1, _)) => {
                    let place = format!("{label}:{}", error.line());
                    return Err(Error::data(place, format!("is no JSON: {error}")));
                }
                Err((line, why)) => return Err(Error::data(format!("{label}:{line}"), why)),
            },
        };
        let mut names: Vec<String> = Vec::new();
        let mut rows = Vec::new();
        for (line, object) in objects {
            let mut cells = BTreeMap::new();
            flatten("", object, &mut cells);
            for name in cells.keys() {
                if names.last() != Some(name) && !names.contains(name) {
                    names.push(name.clone());
                }
            }
            rows.push((line, cells));
        }
        Ok(Self {
            names,
            rows,
            next: 0,
            remark,
        })
    }
}

type NumberedObjects = Vec<(u64, Value)>;

/// The objects of a whole file: its list, the longest list of objects in it, or itself; and what else was left out.
fn objects(whole: Value) -> Result<(NumberedObjects, Option<String>), String> {
    let numbered = |all: Vec<Value>| (1..).zip(all).collect();
    let is_list = |value: &Value| {
        let list = value.as_array();
        list.is_some_and(|list| !list.is_empty() && list.iter().all(Value::is_object))
    };
    match whole {
        Value::Array(all) if all.iter().all(Value::is_object) => Ok((numbered(all), None)),
        Value::Object(mut all) => {
            let lists = all.iter().filter(|(_, value)| is_list(value));
            let longest = lists.max_by_key(|(_, value)| value.as_array().map_or(0, Vec::len));
            let Some(name) = longest.map(|(name, _)| name.clone()) else {
                return Ok((vec![(1, Value::Object(all))], None));
            };
            let list = match all.remove(&name) {
                Some(Value::Array(list)) => list,
                _ => Vec::new(),
            };
            let left = listed(all.keys());
            let remark = (!all.is_empty()).then(|| format!("the list `{name}` is read; left out: {left}"));
            Ok((numbered(list), remark))
        }
        _ => Err("has no objects in rows; allowed: a list of objects, an object with such a list, or an object a line".into()),
    }
}

/// An object a line; else the first line without one, and why.
fn lines(text: &str) -> Result<NumberedObjects, (u64, String)> {
    let lines = (1..).zip(text.lines());
    let lines = lines.filter(|(_, line)| !line.trim().is_empty());
    let object = |(number, line): (u64, &str)| match serde_json::from_str::<Value>(line) {
        Ok(object) if object.is_object() => Ok((number, object)),
        Ok(_) => Err((
            number,
            "is no object; allowed: an object a line".to_string(),
        )),
        Err(error) => Err((number, format!("is no JSON: {error}"))),
    };
    lines.map(object).collect()
}

/// The cells of a value under a name.
fn flatten(name: &str, value: Value, cells: &mut BTreeMap<String, String>) {
    let text = match value {
        Value::Object(all) => {
            for (key, value) in all {
                let name = match name {
                    "" => key,
                    _ => format!("{name}.{key}"),
                };
                flatten(&name, value, cells);
            }
            return;
        }
        Value::Array(all) => {
            for (index, value) in (1..=WIDEST).zip(all) {
                flatten(&format!("{name}[{index}]"), value, cells);
            }
            return;
        }
        Value::Null => String::new(),
        Value::Bool(is_true) => u8::from(is_true).to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => text,
    };
    cells.insert(name.into(), text);
}

impl RecordReader for JsonRows {
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        let Some(row) = self.next.checked_sub(1) else {
            self.next = 1;
            record.begin(1);
            self.names
                .iter()
                .for_each(|name| record.push(name.as_bytes()));
            return Ok(true);
        };
        let Some((line, cells)) = self.rows.get(row) else {
            return Ok(false);
        };
        self.next += 1;
        record.begin(*line);
        for name in &self.names {
            record.push(cells.get(name).map_or(&[][..], String::as_bytes));
        }
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.next.saturating_sub(1) as u64
    }
    fn bytes(&self) -> u64 {
        self.next as u64
    }
    fn remark(&self) -> Option<String> {
        self.remark.clone()
    }
}
