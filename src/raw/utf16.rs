//! A text in UTF-16, which spreadsheets and instruments on Windows write, handed on as UTF-8.

use std::io::{self, BufRead, Read};

/// Bytes that are read at once.
const CHUNK: usize = 1 << 14;

/// Whether the bytes begin with a byte-order mark of UTF-16.
pub fn is_utf16(head: &[u8]) -> bool {
    matches!(head, [0xff, 0xfe, ..] | [0xfe, 0xff, ..])
}

/// Reads UTF-16 with a byte-order mark and gives UTF-8 without one; half a letter becomes U+FFFD.
pub struct Utf16Reader<R> {
    source: R,
    /// Whether the mark is that of little-endian text; none before it was read.
    little: Option<bool>,
    /// A byte without its second, and a unit without the second of its pair.
    half: Option<u8>,
    lead: Option<u16>,
    ready: Vec<u8>,
    given: usize,
}

impl<R: BufRead> Utf16Reader<R> {
    /// A reader of a source that stands at its byte-order mark.
    pub fn new(source: R) -> Self {
        Self { source, little: None, half: None, lead: None, ready: Vec::new(), given: 0 }
    }

    /// Decodes the next bytes; false at the end.
    fn more(&mut self) -> io::Result<bool> {
        let mut bytes = vec![0; CHUNK];
        let count = self.source.read(&mut bytes)?;
        let bytes: Vec<u8> = self.half.take().into_iter().chain(bytes[..count].iter().copied()).collect();
        let end = count == 0;
        let pairs = bytes.chunks_exact(2);
        self.half = pairs.remainder().first().copied().filter(|_| !end);
        let mut units: Vec<u16> = self.lead.take().into_iter().collect();
        for pair in pairs {
            let little = *self.little.get_or_insert(pair[0] == 0xff);
            let unit = if little { u16::from_le_bytes([pair[0], pair[1]]) } else { u16::from_be_bytes([pair[0], pair[1]]) };
            units.push(unit);
        }
        if !end && units.last().is_some_and(|unit| (0xd800..0xdc00).contains(unit)) {
            self.lead = units.pop();
        }
        let letters = char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
        let text: String = letters.filter(|letter| *letter != '\u{feff}').collect();
        (self.ready, self.given) = (text.into_bytes(), 0);
        Ok(!end)
    }
}

impl<R: BufRead> Read for Utf16Reader<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.given == self.ready.len() {
            if !self.more()? && self.ready.is_empty() {
                return Ok(0);
            }
        }
        let count = into.len().min(self.ready.len() - self.given);
        into[..count].copy_from_slice(&self.ready[self.given..self.given + count]);
        self.given += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_orders_of_bytes_give_the_same_text() {
        let text = "Punkt;x [\u{b5}m]\r\nP\u{1d54f};1,5\n".repeat(900);
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = std::iter::once(0xfeff).chain(units.iter().copied()).flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = std::iter::once(0xfeff).chain(units.iter().copied()).flat_map(u16::to_be_bytes).collect();
        for bytes in [little, big] {
            assert!(is_utf16(&bytes));
            let mut read = String::new();
            Utf16Reader::new(&bytes[..]).read_to_string(&mut read).expect("a text");
            assert_eq!(read, text);
        }
        let mut cut = String::new();
        Utf16Reader::new(&[0xff, 0xfe, b'i', 0, b'd'][..]).read_to_string(&mut cut).expect("a text");
        assert_eq!(cut, "i");
    }
}
