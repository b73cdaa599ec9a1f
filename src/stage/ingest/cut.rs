//! Where a piece of a delimited file may be cut: behind its last row that is whole.
//!
//! What stands between quotes may hold line ends. Both are told as [`TextReader`](super::lines::TextReader) tells them when it reads the rows.

use super::fields::Delimiter;
use memchr::{memchr, memrchr};

/// Behind the last row of `text` that is whole, where a row begins at its first byte; nothing where none is.
pub(super) fn cut(text: &[u8], delimiter: Delimiter, comment: Option<&[u8]>) -> Option<usize> {
    let end = memrchr(b'\n', text)? + 1;
    let Some(quote) = memchr(b'"', &text[..end]) else { return Some(end) };
    // As nearly every file has it, the rows before are lines.
    let mut start = memrchr(b'\n', &text[..quote]).map_or(0, |before| before + 1);
    let mut whole = Some(start).filter(|start| *start > 0);
    let mut row = OpenQuote::default();
    while let Some(length) = memchr(b'\n', &text[start..end]) {
        let line = &text[start..start + length];
        start += length + 1;
        let fresh = !row.inside;
        if fresh && (memchr(b'"', line).is_none() || comment.is_some_and(|mark| line.starts_with(mark))) {
            whole = Some(start);
            continue;
        }
        if fresh {
            row = OpenQuote::default();
        }
        row.read(line, delimiter);
        if !row.inside {
            whole = Some(start);
        }
    }
    whole
}

/// Whether a quoted field is still open.
pub(super) struct OpenQuote {
    pub inside: bool,
    /// A quote opens a field here.
    fresh: bool,
}

impl Default for OpenQuote {
    fn default() -> Self {
        Self { inside: false, fresh: true }
    }
}

impl OpenQuote {
    /// Reads one line of a row.
    pub(super) fn read(&mut self, line: &[u8], delimiter: Delimiter) {
        let mut bytes = line.iter().copied().peekable();
        while let Some(byte) = bytes.next() {
            if self.inside {
                // Two of them are one that is part of the text.
                self.inside = byte != b'"' || bytes.next_if_eq(&b'"').is_some();
            } else if delimiter.is(byte) {
                self.fresh = true;
            } else if self.fresh && byte == b'"' {
                (self.inside, self.fresh) = (true, false);
            } else {
                self.fresh = self.fresh && matches!(byte, b' ' | b'\t');
            }
        }
    }
}
