//! Rows of a delimited file as they stand: exact line numbers, quoted fields, bounded memory.
//!
//! A quoted field may hold the delimiter, line ends and `""` for a quote. Empty lines and comments are no rows.

use super::encoding;
use super::layout::FileLayout;
use super::record::{BUFFER, Buffered, FileFormat, RecordFields, RecordReader, failed};
use crate::error::{Error, Result};
use crate::raw::{Utf16Reader, is_utf16};
use memchr::{memchr, memchr2_iter};
use std::io::{BufRead, BufReader, Read};
use std::ops::Range;

/// Longest row, bytes: a file of another kind, or a quote that is never closed, must not fill the memory.
const LONGEST: usize = 1 << 20;

/// What no other kind of file is.
pub(super) const FORMAT: FileFormat = FileFormat { is: |_, _| true, has_sheets: false, open };

fn open(mut source: Buffered, label: &str, layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    if is_utf16(source.fill_buf().map_err(|error| failed(label, &error))?) {
        let text: Box<dyn Read + Send> = Box::new(Utf16Reader::new(source));
        source = BufReader::with_capacity(BUFFER, text);
    }
    Ok(Box::new(TextReader::open(source, label, layout)?))
}

/// What separates fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delimiter {
    Byte(u8),
    Whitespace,
}

/// The delimiter that a person wrote, or `None` for what is not allowed.
pub(super) fn delimiter(text: &str) -> Option<Delimiter> {
    match (text, text.as_bytes()) {
        ("tab", _) => Some(Delimiter::Byte(b'\t')),
        ("whitespace", _) => Some(Delimiter::Whitespace),
        (_, [byte])
            if byte.is_ascii() && !byte.is_ascii_alphanumeric() && !matches!(byte, b'"' | b'\n' | b'\r' | b'.' | b'-' | b'+') =>
        {
            Some(Delimiter::Byte(*byte))
        }
        _ => None,
    }
}

/// Reads one file from its first line to its last.
pub(super) struct TextReader {
    reader: Buffered,
    label: String,
    delimiter: Delimiter,
    comment: Option<Vec<u8>>,
    /// The next row is the header, and a comment.
    header_in_comment: bool,
    /// Physical lines read so far.
    lines: u64,
    bytes: u64,
}

impl TextReader {
    /// Opens a file and skips what stands above header and data; `None` where nothing is left.
    pub(super) fn open(reader: Buffered, label: &str, layout: &FileLayout) -> Result<Self> {
        let delimiter = delimiter(&layout.delimiter).ok_or_else(|| Error::Bug("an unchecked delimiter".into()))?;
        let comment = layout.comment.as_ref().map(|text| text.as_bytes().to_vec());
        let header_in_comment = layout.header_in_comment;
        let mut lines = Self { reader, label: label.into(), delimiter, comment, header_in_comment, lines: 0, bytes: 0 };
        lines.byte_order_mark()?;
        lines.pass(layout.skip)?;
        Ok(lines)
    }
    fn byte_order_mark(&mut self) -> Result<()> {
        let head = self.reader.fill_buf().map_err(|error| failed(&self.label, &error))?;
        // Old Macintosh; one at the end may be a CRLF that was cut.
        let lone = head.iter().position(|byte| *byte == b'\r').is_some_and(|at| at + 1 < head.len());
        if lone && !head.contains(&b'\n') {
            let message = format!(
                "the lines end in CR alone; allowed: LF or CRLF. Save it again with such line ends, or convert it: \
                 `tr '\\r' '\\n' < {} > converted.csv`",
                self.label
            );
            return Err(Error::data(&self.label, message));
        }
        if head.starts_with(&[0xef, 0xbb, 0xbf]) {
            self.reader.consume(3);
            self.bytes += 3;
        }
        Ok(())
    }
    /// Passes over physical lines.
    fn pass(&mut self, count: u64) -> Result<()> {
        let mut text = Vec::new();
        for _ in 0..count {
            text.clear();
            if !self.line(&mut text)? {
                break;
            }
        }
        Ok(())
    }
    /// Appends one physical line without its end; false at the end of the file.
    fn line(&mut self, text: &mut Vec<u8>) -> Result<bool> {
        let buffer = self.reader.fill_buf().map_err(|error| failed(&self.label, &error))?;
        if let Some(end) = memchr(b'\n', buffer).filter(|end| text.len() + end < LONGEST) {
            text.extend_from_slice(buffer[..end].strip_suffix(b"\r").unwrap_or(&buffer[..end]));
            self.reader.consume(end + 1);
            self.bytes += end as u64 + 1;
            self.lines += 1;
            return Ok(true);
        }
        // It ends beyond what is held, or is the last one.
        let room = LONGEST.saturating_sub(text.len()) as u64;
        let read = (&mut self.reader).take(room).read_until(b'\n', text).map_err(|error| failed(&self.label, &error))?;
        if read == 0 && room > 0 {
            return Ok(false);
        }
        self.bytes += read as u64;
        self.lines += 1;
        if text.last() == Some(&b'\n') {
            text.pop();
            if text.last() == Some(&b'\r') {
                text.pop();
            }
        } else if read as u64 == room {
            let message = "a row of more than 1 MiB; allowed: rows ending in LF or CRLF, every quote closed";
            return Err(Error::data(format!("{}:{}", self.label, self.lines), message));
        } else if text.last() == Some(&b'\r') {
            text.pop();
        }
        Ok(true)
    }
    /// Takes the mark of a comment off the header.
    fn uncomment(&mut self, record: &mut RecordFields) -> Result<()> {
        if !self.header_in_comment || record.text.trim_ascii().is_empty() {
            return Ok(());
        }
        self.header_in_comment = false;
        let mark = self.comment.as_deref().unwrap_or_default();
        if !record.text.starts_with(mark) {
            let place = format!("{}:{}", self.label, self.lines);
            let mark = encoding::shown(mark);
            let message = format!("the header does not begin with `{mark}`; allowed: so, or `header_in_comment: false`");
            return Err(Error::data(place, message));
        }
        record.text.drain(..mark.len());
        Ok(())
    }
}

impl RecordReader for TextReader {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        loop {
            record.text.clear();
            if !self.line(&mut record.text)? {
                return Ok(false);
            }
            record.line = self.lines;
            self.uncomment(record)?;
            let comment = self.comment.as_ref().is_some_and(|mark| record.text.starts_with(mark));
            // A line of delimiters alone is a blank row, also where the delimiter is a tab.
            let delimited = || matches!(self.delimiter, Delimiter::Byte(byte) if byte != b' ' && record.text.contains(&byte));
            if comment || (record.text.trim_ascii().is_empty() && !delimited()) {
                continue;
            }
            record.fields.clear();
            record.quoted = !split(&record.text, self.delimiter, &mut record.fields);
            if !record.quoted {
                return Ok(true);
            }
            while !unquote(record, self.delimiter) {
                record.text.push(b'\n');
                if !self.line(&mut record.text)? {
                    return Err(Error::data(format!("{}:{}", self.label, record.line), "a quoted field is not closed"));
                }
            }
            return Ok(true);
        }
    }
    fn lines(&self) -> u64 {
        self.lines
    }
    fn bytes(&self) -> u64 {
        self.bytes
    }
    fn is_text(&self) -> bool {
        true
    }
    fn skip(&mut self, lines: u64) -> Result<()> {
        self.pass(lines)
    }
}

/// Fields of a row without quotes; false where it has some.
fn split(text: &[u8], delimiter: Delimiter, fields: &mut Vec<Range<usize>>) -> bool {
    let mut start = 0;
    match delimiter {
        Delimiter::Byte(delimiter) => {
            for index in memchr2_iter(delimiter, b'"', text) {
                if text[index] == b'"' {
                    return false;
                }
                fields.push(start..index);
                start = index + 1;
            }
            fields.push(start..text.len());
        }
        Delimiter::Whitespace => {
            let mut inside = false;
            for (index, byte) in text.iter().enumerate() {
                let blank = matches!(byte, b' ' | b'\t');
                if inside && blank {
                    fields.push(start..index);
                } else if !inside && !blank {
                    start = index;
                }
                inside = !blank;
            }
            if inside {
                fields.push(start..text.len());
            }
            return !text.contains(&b'"');
        }
    }
    true
}

/// Fields of a row with quotes; false where a quote is still open at the end.
fn unquote(record: &mut RecordFields, delimiter: Delimiter) -> bool {
    record.fields.clear();
    record.unquoted.clear();
    let (mut start, mut inside, mut fresh) = (0, false, true);
    let mut bytes = record.text.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        let ends = !inside
            && match delimiter {
                Delimiter::Byte(delimiter) => byte == delimiter,
                Delimiter::Whitespace => matches!(byte, b' ' | b'\t'),
            };
        if inside && byte == b'"' {
            if bytes.peek() == Some(&b'"') {
                bytes.next();
                record.unquoted.push(b'"');
            } else {
                inside = false;
            }
        } else if ends {
            if delimiter != Delimiter::Whitespace || !fresh {
                record.fields.push(start..record.unquoted.len());
            }
            start = record.unquoted.len();
            fresh = true;
        } else if fresh && byte == b'"' {
            inside = true;
            fresh = false;
        } else {
            // Blanks before a quote do not make it part of the text.
            fresh = fresh && !inside && matches!(byte, b' ' | b'\t');
            record.unquoted.push(byte);
        }
    }
    if delimiter != Delimiter::Whitespace || !fresh {
        record.fields.push(start..record.unquoted.len());
    }
    !inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str, delimiter: &str, comment: Option<&str>) -> Vec<(u64, Vec<String>)> {
        let layout = FileLayout {
            file: Default::default(),
            sheet: None,
            delimiter: delimiter.into(),
            decimal: Default::default(),
            header: true,
            skip: 0,
            skip_below_header: 0,
            comment: comment.map(Into::into),
            header_in_comment: false,
            targets: None,
            columns: Default::default(),
        };
        let reader = BufReader::new(Box::new(std::io::Cursor::new(text.to_string())) as Box<dyn Read + Send>);
        let mut lines = TextReader::open(reader, "a.csv", &layout).unwrap();
        let (mut record, mut rows) = (RecordFields::default(), Vec::new());
        while lines.next(&mut record).unwrap() {
            let fields = (0..record.len()).map(|index| String::from_utf8_lossy(record.field(index).unwrap()).into()).collect();
            rows.push((record.line, fields));
        }
        rows
    }

    fn row(line: u64, fields: &[&str]) -> (u64, Vec<String>) {
        (line, fields.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn line_numbers_survive_crlf_comments_and_empty_lines() {
        let text = "\u{feff}a,b\r\n\r\n# no row\r\n1,2\r\n\n3, 4";
        assert_eq!(rows(text, ",", Some("#")), [row(1, &["a", "b"]), row(4, &["1", "2"]), row(6, &["3", "4"])]);
    }

    #[test]
    fn quoted_fields_hold_delimiters_quotes_and_line_ends() {
        let text = "\"a;\"\"b\"\"\";2\n \"x\ny\" ;3\n4;5;\n;;\n";
        let expected = [row(1, &["a;\"b\"", "2"]), row(2, &["x\ny", "3"]), row(4, &["4", "5", ""]), row(5, &["", "", ""])];
        assert_eq!(rows(text, ";", None), expected);
    }

    #[test]
    fn runs_of_blanks_separate_where_whitespace_does() {
        let text = "  a\t b  \n1   \"two words\"  3\n";
        assert_eq!(rows(text, "whitespace", None), [row(1, &["a", "b"]), row(2, &["1", "two words", "3"])]);
        assert_eq!(rows("a\tb\n\t\n", "tab", None), [row(1, &["a", "b"]), row(2, &["", ""])]);
    }
}
