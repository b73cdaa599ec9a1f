//! The fields of a row: what separates them, and how they are quoted.

use super::record::RecordFields;
use std::ops::Range;

/// What separates fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delimiter {
    Byte(u8),
    Whitespace,
}

impl Delimiter {
    /// Whether a byte separates fields, outside of quotes.
    pub(super) fn is(self, byte: u8) -> bool {
        match self {
            Self::Byte(delimiter) => byte == delimiter,
            Self::Whitespace => matches!(byte, b' ' | b'\t'),
        }
    }
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

/// Fields of a row without quotes; false where it has some.
pub(super) fn split(text: &[u8], delimiter: Delimiter, fields: &mut Vec<Range<usize>>) -> bool {
    let mut start = 0;
    match delimiter {
        Delimiter::Byte(delimiter) => {
            let (chunks, tail) = text.as_chunks::<8>();
            for (chunk, place) in chunks.iter().zip((0..).step_by(8)) {
                let word = u64::from_le_bytes(*chunk);
                if bytes_that_are(b'"', word) != 0 {
                    return false;
                }
                let mut ends = bytes_that_are(delimiter, word);
                while ends != 0 {
                    let end = place + ends.trailing_zeros() as usize / 8;
                    fields.push(start..end);
                    start = end + 1;
                    ends &= ends - 1;
                }
            }
            for (end, byte) in (text.len() - tail.len()..).zip(tail) {
                if *byte == b'"' {
                    return false;
                }
                if *byte == delimiter {
                    fields.push(start..end);
                    start = end + 1;
                }
            }
            fields.push(start..text.len());
        }
        Delimiter::Whitespace => {
            let mut inside = false;
            for (index, byte) in text.iter().enumerate() {
                let blank = Delimiter::Whitespace.is(*byte);
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

/// The highest bit of each byte of `word` that is `wanted`.
fn bytes_that_are(wanted: u8, word: u64) -> u64 {
    const LOW: u64 = u64::from_le_bytes([0x7f; 8]);
    let other = word ^ u64::from_le_bytes([wanted; 8]);
    !(((other & LOW) + LOW) | other | LOW)
}

/// Fields of a row with quotes, all of them closed.
pub(super) fn unquote(record: &mut RecordFields, delimiter: Delimiter) {
    record.fields.clear();
    record.unquoted.clear();
    let (mut start, mut inside, mut fresh) = (0, false, true);
    let mut bytes = record.text.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        let ends = !inside && delimiter.is(byte);
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
}
