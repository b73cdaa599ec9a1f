//! Rows of delimited text as they stand: exact line numbers, quoted fields, bounded memory.
//!
//! A quoted field may hold the delimiter, line ends and `""` for a quote; blanks may stand before its quote. Empty lines and comments are no
//! rows. The crate `csv` is not used: it has neither runs of blanks as a delimiter, nor comments of two letters, nor a longest row.

use super::record::{Record, RecordFault, RecordReader, failed};
use super::shown;
use crate::error::{Error, Result};
use memchr::{memchr, memchr2_iter};
use std::borrow::Cow;
use std::io::{BufRead, Read};
use std::ops::Range;

/// Longest row, bytes: a file of another kind, or a quote that is never closed, must not fill the memory.
const LONGEST: usize = 1 << 20;

/// What separates fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// This byte.
    Byte(u8),
    /// Any run of blanks and tabs.
    Whitespace,
}

impl Delimiter {
    /// The delimiter that a person wrote, or `None` for what is not allowed.
    pub fn parse(text: &str) -> Option<Self> {
        match (text, text.as_bytes()) {
            ("tab", _) => Some(Self::Byte(b'\t')),
            ("whitespace", _) => Some(Self::Whitespace),
            (_, [byte])
                if byte.is_ascii()
                    && !byte.is_ascii_alphanumeric()
                    && !matches!(byte, b'"' | b'\n' | b'\r' | b'.' | b'-' | b'+') =>
            {
                Some(Self::Byte(*byte))
            }
            _ => None,
        }
    }
}

/// A row that is taken apart, as far as it was read.
#[derive(Debug, Clone, Copy, Default)]
struct Splitter {
    seen: usize,
    start: usize,
    /// Where the quote stands that opened it and was not closed yet.
    open: Option<usize>,
    /// Where the quotes of the present field close.
    closed: Option<usize>,
    /// Whether a field has quotes around it.
    has_quoted: bool,
    /// The first field with text behind its closing quote, and where that text begins.
    stray: Option<(usize, usize)>,
}

impl Splitter {
    /// Places of the fields of a row with their quotes and the blanks around them. Where a quote is left open, the last field is missing until
    /// more of the row is there.
    fn split(&mut self, text: &[u8], delimiter: Delimiter, fields: &mut Vec<Range<usize>>) {
        let from = self.seen;
        self.seen = text.len();
        match delimiter {
            Delimiter::Byte(byte) => {
                let mut next = from;
                for at in memchr2_iter(byte, b'"', &text[from..]).map(|at| from + at) {
                    if at < next {
                        continue;
                    }
                    if text[at] == byte {
                        if self.open.is_none() {
                            self.end_field(text, at, fields);
                        }
                    } else if self.quote(text, at) {
                        next = at + 2;
                    }
                }
                if self.open.is_none() {
                    self.end_field(text, text.len(), fields);
                }
            }
            Delimiter::Whitespace => {
                let (mut inside, mut next) = (from > 0, from);
                for (at, byte) in text.iter().enumerate().skip(from) {
                    let is_blank = matches!(byte, b' ' | b'\t');
                    if at < next || self.open.is_some() && *byte != b'"' {
                        continue;
                    }
                    if inside && is_blank {
                        self.end_field(text, at, fields);
                        inside = false;
                    } else if !inside && !is_blank {
                        (inside, self.start) = (true, at);
                    }
                    if *byte == b'"' && self.quote(text, at) {
                        next = at + 2;
                    }
                }
                if inside && self.open.is_none() {
                    self.end_field(text, text.len(), fields);
                }
            }
        }
    }

    fn end_field(&mut self, text: &[u8], at: usize, fields: &mut Vec<Range<usize>>) {
        fields.push(self.start..at);
        self.start = at + 1;
        if let Some(closed) = self.closed.take()
            && let behind = text[closed..at].trim_ascii()
            && !behind.is_empty()
        {
            let begins =
                closed + text[closed..at].len() - text[closed..at].trim_ascii_start().len();
            self.stray.get_or_insert((fields.len(), begins));
        }
    }

    /// Reads a quote; whether it and the next one are one that is part of the text.
    fn quote(&mut self, text: &[u8], at: usize) -> bool {
        if self.open.is_some() {
            if text.get(at + 1) == Some(&b'"') {
                return true;
            }
            (self.open, self.closed) = (None, Some(at + 1));
        } else if text[self.start..at].trim_ascii().is_empty() {
            (self.open, self.has_quoted) = (Some(at), true);
        }
        false
    }
}

/// Why text behind the quotes of a field is refused.
const STRAY: &str = "text behind the closing `\"` of a field; allowed: a delimiter there, and `\"\"` for a quote inside";

/// Places of the fields of a line with their quotes and the blanks around them, and where its quotes are not well formed, with the reason.
/// Where a quote is left open, the last field reaches to the end.
pub fn fields(
    line: &str,
    delimiter: Delimiter,
) -> (Vec<Range<usize>>, Option<(usize, &'static str)>) {
    let (mut fields, mut splitter) = (Vec::with_capacity(16), Splitter::default());
    splitter.split(line.as_bytes(), delimiter, &mut fields);
    if splitter.open.is_some() {
        fields.push(splitter.start..line.len());
    }
    let open = splitter
        .open
        .map(|at| (at, "`\"` is not closed on its line"));
    (fields, splitter.stray.map(|(_, at)| (at, STRAY)).or(open))
}

/// A field without the blanks and the quotes around it, and with one quote for two inside.
pub fn unquoted_text(field: &str) -> Cow<'_, str> {
    match unquoted(field.trim().as_bytes()) {
        Cow::Borrowed(bytes) => String::from_utf8_lossy(bytes),
        Cow::Owned(bytes) => String::from_utf8_lossy(&bytes).into_owned().into(),
    }
}

fn unquoted(field: &[u8]) -> Cow<'_, [u8]> {
    let field = field.trim_ascii();
    let Some(inner) = field.strip_prefix(b"\"") else {
        return Cow::Borrowed(field);
    };
    if let Some((b'"', inner)) = inner.split_last()
        && memchr(b'"', inner).is_none()
    {
        return Cow::Borrowed(inner);
    }
    let (mut text, mut inside) = (Vec::with_capacity(inner.len()), true);
    let mut bytes = inner.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        if inside && byte == b'"' && bytes.next_if_eq(&b'"').is_none() {
            // A row with text behind it is refused.
            inside = false;
        } else {
            text.push(byte);
        }
    }
    Cow::Owned(text)
}

/// How a delimited text is written; without more, commas between fields and a header on the first line.
#[derive(Debug, Clone)]
pub struct TextLayout {
    /// What stands between two fields.
    pub delimiter: Delimiter,
    /// How lines begin that are no rows.
    pub comment: Option<String>,
    /// The first row is the header, and a comment.
    pub header_in_comment: bool,
    /// Lines above the first row.
    pub skip: u64,
}

impl Default for TextLayout {
    fn default() -> Self {
        Self {
            delimiter: Delimiter::Byte(b','),
            comment: None,
            header_in_comment: false,
            skip: 0,
        }
    }
}

/// Reads one text from its first line to its last.
pub struct TextRows<R> {
    reader: R,
    label: String,
    layout: TextLayout,
    /// Physical lines read so far.
    lines: u64,
    bytes: u64,
}

impl<R: BufRead> TextRows<R> {
    /// Opens a text without a byte-order mark and skips what stands above header and data.
    pub fn open(mut reader: R, label: &str, layout: TextLayout) -> Result<Self> {
        let head = reader.fill_buf().map_err(|error| failed(label, &error))?;
        // Old Macintosh; one at the end may be a CRLF that was cut.
        let lone = head
            .iter()
            .position(|byte| *byte == b'\r')
            .is_some_and(|at| at + 1 < head.len());
        if lone && !head.contains(&b'\n') {
            let message = format!(
                "the lines end in CR alone; allowed: LF or CRLF. Save it again with such line ends, or convert it: \
                 `tr '\\r' '\\n' < {label} > converted.csv`"
            );
            return Err(Error::data(label, message));
        }
        let skip = layout.skip;
        let mut rows = Self {
            reader,
            label: label.into(),
            layout,
            lines: 0,
            bytes: 0,
        };
        rows.pass(skip)?;
        Ok(rows)
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
        let room = LONGEST.saturating_sub(text.len()) as u64;
        let read = (&mut self.reader)
            .take(room)
            .read_until(b'\n', text)
            .map_err(|error| failed(&self.label, &error))?;
        if read == 0 && room > 0 {
            return Ok(false);
        }
        self.bytes += read as u64;
        self.lines += 1;
        if room > 0 && text.last() == Some(&b'\n') {
            text.pop();
        } else if read as u64 == room {
            let message =
                "a row of more than 1 MiB; allowed: rows ending in LF or CRLF, every quote closed";
            let place = format!("{}:{}", self.label, self.lines);
            return Err(Error::data(place, message));
        }
        if text.last() == Some(&b'\r') {
            text.pop();
        }
        Ok(true)
    }
    /// Takes the mark of a comment off the header.
    fn uncomment(&mut self, record: &mut Record) -> Result<()> {
        if !self.layout.header_in_comment || record.text.trim_ascii().is_empty() {
            return Ok(());
        }
        self.layout.header_in_comment = false;
        let mark = self.layout.comment.as_deref().unwrap_or_default();
        let mark = mark.as_bytes();
        if !record.text.starts_with(mark) {
            let place = format!("{}:{}", self.label, self.lines);
            let mark = shown(mark);
            let message = format!(
                "the header does not begin with `{mark}`; allowed: so, or `header_in_comment: false`"
            );
            return Err(Error::data(place, message));
        }
        record.text.drain(..mark.len());
        Ok(())
    }
    /// Whether a line is no row.
    fn is_passed_over(&self, line: &[u8]) -> bool {
        let comment = self.layout.comment.as_ref();
        let is_comment = comment.is_some_and(|mark| line.starts_with(mark.as_bytes()));
        // A line of delimiters alone is a blank row, also where the delimiter is a tab.
        let delimited = || matches!(self.layout.delimiter, Delimiter::Byte(byte) if byte != b' ' && line.contains(&byte));
        is_comment || (line.trim_ascii().is_empty() && !delimited())
    }
}

impl<R: BufRead + Send> RecordReader for TextRows<R> {
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        loop {
            record.text.clear();
            if !self.line(&mut record.text)? {
                return Ok(false);
            }
            record.line = self.lines;
            self.uncomment(record)?;
            if !self.is_passed_over(&record.text) {
                break;
            }
        }
        record.fields.clear();
        let mut splitter = Splitter::default();
        splitter.split(&record.text, self.layout.delimiter, &mut record.fields);
        while splitter.open.is_some() {
            record.text.push(b'\n');
            if !self.line(&mut record.text)? {
                let place = format!("{}:{}", self.label, record.line);
                return Err(Error::data(place, "a quoted field is not closed"));
            }
            splitter.split(&record.text, self.layout.delimiter, &mut record.fields);
        }
        record.is_quoted = splitter.has_quoted;
        record.fault = splitter
            .stray
            .map(|(field, _)| (RecordFault::Damaged, format!("column {field}: {STRAY}")));
        if record.is_quoted {
            record.unquoted.clear();
            for place in &mut record.fields {
                let (start, field) = (record.unquoted.len(), &record.text[place.clone()]);
                record.unquoted.extend_from_slice(&unquoted(field));
                *place = start..record.unquoted.len();
            }
        }
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.lines
    }
    fn bytes(&self) -> u64 {
        self.bytes
    }
    fn obeys_layout(&self) -> bool {
        true
    }
    fn skip(&mut self, lines: u64) -> Result<()> {
        self.pass(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn opened(text: &[u8], delimiter: &str, comment: Option<&str>) -> TextRows<Cursor<Vec<u8>>> {
        let delimiter = Delimiter::parse(delimiter).unwrap();
        let layout = TextLayout {
            delimiter,
            comment: comment.map(Into::into),
            ..TextLayout::default()
        };
        TextRows::open(Cursor::new(text.to_vec()), "a.csv", layout).unwrap()
    }

    type Rows = Vec<(u64, Vec<String>)>;

    fn all(reader: &mut dyn RecordReader) -> Result<Rows> {
        let (mut record, mut rows) = (Record::default(), Vec::new());
        while reader.next(&mut record)? {
            rows.push((record.line, record.cells()));
        }
        Ok(rows)
    }

    fn reads(text: &str, delimiter: &str, comment: Option<&str>, expected: &[(u64, &[&str])]) {
        let rows = all(&mut opened(text.as_bytes(), delimiter, comment)).unwrap();
        let found = rows
            .iter()
            .map(|(line, fields)| (*line, fields.iter().map(String::as_str).collect()));
        let found: Vec<(u64, Vec<&str>)> = found.collect();
        let expected = expected
            .iter()
            .map(|(line, fields)| (*line, fields.to_vec()));
        assert_eq!(found, expected.collect::<Vec<_>>());
    }

    #[test]
    fn line_numbers_survive_crlf_comments_and_empty_lines() {
        let text = "a,b\r\n\r\n# no row\r\n1,2\r\n\n3, 4";
        let expected = [(1, &["a", "b"][..]), (4, &["1", "2"]), (6, &["3", "4"])];
        reads(text, ",", Some("#"), &expected);
        let expected = [(1, &["a\rb", "c"][..]), (2, &["1"])];
        reads("a\rb,c\r\n\r1\n", ",", None, &expected);
    }

    #[test]
    fn quoted_fields_hold_delimiters_quotes_and_line_ends() {
        let text = "\"a;\"\"b\"\"\";2\n \"x\ny\" ;3\n4;5;\n;;\n";
        let expected = [
            (1, &["a;\"b\"", "2"][..]),
            (2, &["x\ny", "3"]),
            (4, &["4", "5", ""]),
            (5, &["", "", ""]),
        ];
        reads(text, ";", None, &expected);
        // A quote inside a field is text.
        let expected = [(1, &["5\" pipe", "a", ""][..]), (2, &["6\"", "\""])];
        reads("5\" pipe,a,\"\"\n6\",\"\"\"\"", ",", None, &expected);
        let expected = [(1, &["a\n\n# b", "1"][..]), (4, &["\"\nc\"", "2"])];
        let text = "\"a\r\n\r\n# b\",1\n \"\"\"\nc\"\"\",2";
        reads(text, ",", Some("#"), &expected);
    }

    #[test]
    fn runs_of_blanks_separate_where_whitespace_does() {
        let text = "  a\t b  \n1   \"two words\"  3\n \"c\nd\"  e \n f\"g h\"\n";
        let expected = [
            (1, &["a", "b"][..]),
            (2, &["1", "two words", "3"]),
            (3, &["c\nd", "e"]),
            (5, &["f\"g", "h\""]),
        ];
        assert!(!has_fault("f\"g h\"\n", "whitespace"));
        reads(text, "whitespace", None, &expected);
        reads(
            "a\tb\n\t\n",
            "tab",
            None,
            &[(1, &["a", "b"]), (2, &["", ""])],
        );
    }

    fn has_fault(text: &str, delimiter: &str) -> bool {
        let (mut reader, mut record) =
            (opened(text.as_bytes(), delimiter, None), Record::default());
        reader.next(&mut record).unwrap();
        record.fault.is_some()
    }

    #[test]
    fn text_behind_a_closing_quote_is_a_fault_of_its_row() {
        let text = "a,b\n1,\"0.25\"0\n2,\"0.25\" \n3,\"x\ny\" z\n4,\"\"\"\"\n\"5\"\"\"6,7\n";
        let mut reader = opened(text.as_bytes(), ",", None);
        let (mut record, mut faults) = (Record::default(), Vec::new());
        while reader.next(&mut record).unwrap() {
            if let Some((kind, why)) = record.fault.take() {
                assert_eq!(kind, RecordFault::Damaged);
                faults.push((record.line, why.split(':').next().unwrap().to_string()));
            }
        }
        let column = |line: u64, number: usize| (line, format!("column {number}"));
        assert_eq!(faults, [column(2, 2), column(4, 2), column(7, 1)]);
        for (text, delimiter, expected) in [
            ("\"a\"b\n", ";", true),
            ("\"a\"b c\n", "whitespace", true),
            ("\"a\" b\n", "whitespace", false),
            ("\"a\"\t b\n", "tab", false),
            (" \"a\" x\tb\n", "tab", true),
        ] {
            assert_eq!(has_fault(text, delimiter), expected, "{text}");
        }
        let at = |line: &str| fields(line, Delimiter::Byte(b',')).1.map(|(at, _)| at);
        assert_eq!(at("1,\"0.25\"0,2"), Some(8));
        assert_eq!(at("1,\"0.25\",\"2"), Some(9));
        assert_eq!(at("1,\"0.25\" ,2"), None);
    }

    #[test]
    fn a_quote_that_is_never_closed_is_a_fault_of_its_line() {
        let refusal = |text: &str| {
            all(&mut opened(text.as_bytes(), ",", None))
                .unwrap_err()
                .to_string()
        };
        assert!(
            refusal("a,b\n\"never closed\n1,2\n").contains("a.csv:2")
                && refusal("a,b\n\"never").contains("a quoted field is not closed")
        );
        let is_long = |text: String| {
            let message = refusal(&text);
            assert!(message.contains("a row of more than 1 MiB"), "{message}");
        };
        for length in LONGEST - 3..=LONGEST + 1 {
            let (a, b) = ("a".repeat(length - 2), "b".repeat(100));
            is_long(format!("\"{a}\n{b}\n"));
        }
        // At once, however many lines and quotes it takes in.
        for line in ["a\n", "\"\"\n"] {
            is_long(format!("\"{}", line.repeat(LONGEST)));
        }
    }
}
