//! Rows of a delimited file as they stand: exact line numbers, quoted fields, bounded memory.
//!
//! A quoted field may hold the delimiter, line ends and `""` for a quote. Empty lines and comments are no rows.

use super::cut::{OpenQuote, cut};
use super::encoding;
use super::fields::{Delimiter, delimiter, split, unquote};
use super::layout::FileLayout;
use super::record::{BUFFER, Buffered, FileFormat, RecordFields, RecordReader, failed};
use crate::error::{Error, Result};
use crate::raw::{Utf16Reader, is_utf16, not_read};
use memchr::{memchr, memchr_iter};
use std::io::{BufRead, BufReader, Cursor, Read};

/// Longest row, bytes: a file of another kind, or a quote that is never closed, must not fill the memory.
const LONGEST: usize = 1 << 20;

/// Bytes of a block of rows: enough of them that threads seldom meet, few enough to stay in a core's cache.
const BLOCK: usize = 1 << 18;

/// What no other kind of file is.
pub(super) const FORMAT: FileFormat = FileFormat { is: |_, _| true, has_sheets: false, open };

fn open(mut source: Buffered, label: &str, layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    let head = source.fill_buf().map_err(|error| failed(label, &error))?;
    if let Some(what) = not_read(head) {
        return Err(Error::data(label, what));
    }
    if is_utf16(head) {
        let text: Box<dyn Read + Send> = Box::new(Utf16Reader::new(source));
        source = BufReader::with_capacity(BUFFER, text);
    }
    Ok(Box::new(TextReader::open(source, label, layout)?))
}

/// Reads one file from its first line to its last.
pub(super) struct TextReader<R> {
    reader: R,
    label: String,
    delimiter: Delimiter,
    comment: Option<Vec<u8>>,
    /// The next row is the header, and a comment.
    header_in_comment: bool,
    /// Physical lines read so far.
    lines: u64,
    bytes: u64,
    /// What was read behind the last row of a block.
    rest: Vec<u8>,
    /// Bytes of a block, about.
    block: usize,
}

impl<R: BufRead> TextReader<R> {
    /// Opens a file and skips what stands above header and data; `None` where nothing is left.
    pub(super) fn open(reader: R, label: &str, layout: &FileLayout) -> Result<Self> {
        let delimiter = delimiter(&layout.delimiter).ok_or_else(|| Error::Bug("an unchecked delimiter".into()))?;
        let comment = layout.comment.as_ref().map(|text| text.as_bytes().to_vec());
        let header_in_comment = layout.header_in_comment;
        let mut lines = Self {
            reader,
            label: label.into(),
            delimiter,
            comment,
            header_in_comment,
            lines: 0,
            bytes: 0,
            rest: Vec::new(),
            block: BLOCK,
        };
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
        if room > 0 && text.last() == Some(&b'\n') {
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

impl<R: TextBytes> RecordReader for TextReader<R> {
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
            let (mut quote, mut seen) = (OpenQuote::default(), 0);
            loop {
                quote.read(&record.text[seen..], self.delimiter);
                if !quote.inside {
                    break;
                }
                record.text.push(b'\n');
                seen = record.text.len();
                if !self.line(&mut record.text)? {
                    return Err(Error::data(format!("{}:{}", self.label, record.line), "a quoted field is not closed"));
                }
            }
            unquote(record, self.delimiter);
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
    fn block(&mut self, room: Vec<u8>) -> Result<Option<Box<dyn RecordReader>>> {
        let mut text = room;
        text.clear();
        text.append(&mut self.rest);
        loop {
            let room = self.block.max(text.len());
            text.reserve(room);
            let read = (&mut self.reader).take(room as u64).read_to_end(&mut text);
            let is_last = read.map_err(|error| failed(&self.label, &error))? < room;
            // A row that is too long is told by whoever reads it.
            let whole = if is_last || text.len() > 2 * LONGEST { Some(text.len()) } else { None };
            let Some(end) = whole.or_else(|| cut(&text, self.delimiter, self.comment.as_deref())) else { continue };
            if end == 0 {
                return Ok(None);
            }
            self.rest.extend_from_slice(&text[end..]);
            text.truncate(end);
            let lines = memchr_iter(b'\n', &text).count() as u64;
            let block = TextReader {
                reader: Cursor::new(text),
                label: self.label.clone(),
                delimiter: self.delimiter,
                comment: self.comment.clone(),
                header_in_comment: self.header_in_comment,
                lines: self.lines,
                bytes: self.bytes,
                rest: Vec::new(),
                block: self.block,
            };
            (self.lines, self.bytes) = (self.lines + lines, self.bytes + end as u64);
            return Ok(Some(Box::new(block)));
        }
    }
    fn room(self: Box<Self>) -> Vec<u8> {
        self.reader.room()
    }
}

/// Where text comes from: a file, or a block of one.
pub(super) trait TextBytes: BufRead + Send {
    /// The buffer that holds the bytes of a block; empty for a file.
    fn room(self) -> Vec<u8>
    where
        Self: Sized,
    {
        Vec::new()
    }
}

impl TextBytes for Buffered {}

impl TextBytes for Cursor<Vec<u8>> {
    fn room(self) -> Vec<u8> {
        self.into_inner()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opened(text: &[u8], delimiter: &str, comment: Option<&str>) -> TextReader<Cursor<Vec<u8>>> {
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
        TextReader::open(Cursor::new(text.to_vec()), "a.csv", &layout).unwrap()
    }

    type Rows = Vec<(u64, Vec<String>)>;

    fn all(reader: &mut dyn RecordReader) -> Result<Rows> {
        let (mut record, mut rows) = (RecordFields::default(), Vec::new());
        while reader.next(&mut record)? {
            let fields = (0..record.len()).map(|index| String::from_utf8_lossy(record.field(index).unwrap()).into()).collect();
            rows.push((record.line, fields));
        }
        Ok(rows)
    }

    fn rows(text: &str, delimiter: &str, comment: Option<&str>) -> Rows {
        all(&mut opened(text.as_bytes(), delimiter, comment)).unwrap()
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

    /// Rows with lines and bytes at the end, read in blocks of about so many bytes; or what is wrong.
    fn in_blocks(mut reader: TextReader<Cursor<Vec<u8>>>, bytes: usize) -> Result<(Rows, u64, u64), String> {
        reader.block = bytes;
        let mut rows = Vec::new();
        let mut end = (reader.lines(), reader.bytes());
        while let Some(mut block) = reader.block(Vec::new()).map_err(|error| error.to_string())? {
            rows.extend(all(block.as_mut()).map_err(|error| error.to_string())?);
            end = (block.lines(), block.bytes());
        }
        Ok((rows, end.0, end.1))
    }

    #[test]
    fn blocks_of_any_size_hold_the_rows_of_the_file() {
        let texts: [(&[u8], &str); 14] = [
            (b"", ","),
            (b"\n\n", ","),
            (b"a,b", ","),
            (b"\xef\xbb\xbfa,b\r\n\r\n# no \" row\r\n1,2\r\n\n3, 4", ","),
            (b"a;b\n\"x\ny\";1\n\n\"\"\"\n\"\"\";2\n", ";"),
            (b"\"a\r\n\r\nb\",1\r\n \"c\n# d\",2\r\n", ","),
            (b"5\" pipe,1\n6\"\n7\"\n", ","),
            (b"\"a\"b\"\n\"\"\n\"\"\"\"\n", ","),
            (b"1\t\t\n\t\t\n2\t3\t\"\n\"", "tab"),
            (b" a \"b\nc\"  d\n  \ne \"\" f\n", "whitespace"),
            (b"a,\0,b\n\0\n\"\0\n\",1\n", ","),
            (b"a,b\n\"never closed\n1,2\n", ","),
            (b"a,b\n\"never closed", ","),
            (b"a\rb,c\r\n\r1\n", ","),
        ];
        for (text, delimiter) in texts {
            let mut reader = opened(text, delimiter, Some("#"));
            let whole = all(&mut reader).map_err(|error| error.to_string());
            let whole = whole.map(|rows| (rows, reader.lines(), reader.bytes()));
            for bytes in 1..=text.len() + 1 {
                let found = in_blocks(opened(text, delimiter, Some("#")), bytes);
                assert_eq!(found, whole, "{bytes} of {}", String::from_utf8_lossy(text));
            }
        }
    }

    #[test]
    fn a_quoted_field_that_fills_the_longest_row_to_its_last_byte_is_too_long() {
        for length in [LONGEST - 3, LONGEST - 2, LONGEST - 1, LONGEST, LONGEST + 1] {
            let text = format!("\"{}\n{}\n", "a".repeat(length - 2), "b".repeat(100));
            let said = all(&mut opened(text.as_bytes(), ",", None)).unwrap_err().to_string();
            assert!(said.contains("a row of more than 1 MiB"), "{length}: {said}");
            assert_eq!(in_blocks(opened(text.as_bytes(), ",", None), 1 << 10), Err(said));
        }
        // A quote that is never closed is told at once, however many lines it takes in.
        let said = all(&mut opened(format!("\"{}", "a\n".repeat(LONGEST)).as_bytes(), ",", None)).unwrap_err().to_string();
        assert!(said.contains("a row of more than 1 MiB"), "{said}");
    }
}
