//! Bytes of others as text: UTF-16 by its byte-order mark, else UTF-8, else Windows-1252, which German, French and Spanish spreadsheets and
//! controllers write; and files that are known and not read, by how they begin.

use encoding_rs::WINDOWS_1252;
use encoding_rs_io::DecodeReaderBytesBuilder;
use std::borrow::Cow;
use std::io::{self, Cursor, Read};

/// Bytes that are handed on in one piece at first.
const HEAD: u64 = 1 << 16;

/// Whether the bytes begin with a byte-order mark of UTF-16.
pub fn is_utf16(head: &[u8]) -> bool {
    matches!(head, [0xff, 0xfe, ..] | [0xfe, 0xff, ..])
}

/// The same bytes without a byte-order mark, UTF-16 as UTF-8.
pub fn without_utf16(source: impl Read + Send + 'static) -> io::Result<Box<dyn Read + Send>> {
    let mut text = DecodeReaderBytesBuilder::new()
        .utf8_passthru(true)
        .strip_bom(true)
        .build(source);
    // The decoder's first piece is some bytes, and whoever reads looks at how the first lines end.
    let mut head = Vec::new();
    (&mut text).take(HEAD).read_to_end(&mut head)?;
    Ok(Box::new(Cursor::new(head).chain(text)))
}

/// The text, or nothing where the bytes are neither UTF-8 nor Windows-1252.
pub fn decoded_text(bytes: &[u8]) -> Option<Cow<'_, str>> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Some(Cow::Borrowed(text));
    }
    let (text, _) = WINDOWS_1252.decode_without_bom_handling(bytes);
    // The crate gives the five bytes without a letter as control codes.
    (!text.contains(|letter| ('\u{80}'..='\u{9f}').contains(&letter))).then_some(text)
}

/// The text for people: what is no letter is shown as such.
pub fn shown(bytes: &[u8]) -> Cow<'_, str> {
    decoded_text(bytes).unwrap_or_else(|| String::from_utf8_lossy(bytes))
}

/// How programs begin, and what they are.
const PROGRAMS: [(&str, &str); 7] = [
    ("/PROG", FANUC),
    ("MODULE", RAPID),
    ("%%%", RAPID),
    ("&ACCESS", KRL),
    ("&REL", KRL),
    ("DEFDAT", KRL),
    ("DEF", KRL),
];
const FANUC: &str =
    "is a FANUC program (a listing of TP): name it .ls, and its joint positions are read";
const RAPID: &str =
    "is an ABB program in RAPID: name it .mod or .prg, and its joint positions are read";
const KRL: &str =
    "is a KUKA program in KRL: name it .src or .dat, and its joint positions are read";

/// What a file is that begins so and is not read under its name, and what to do; none where it may be delimited text.
pub fn not_read(head: &[u8]) -> Option<&'static str> {
    let begins = head.trim_ascii_start();
    let is = |word: &str| {
        let tail = begins.get(word.len()..).unwrap_or_default();
        begins.starts_with(word.as_bytes())
            && (word == "%%%"
                || tail
                    .first()
                    .is_some_and(|next| [b' ', b'\t'].contains(next)))
    };
    PROGRAMS
        .iter()
        .find(|(word, _)| is(word))
        .map(|(_, what)| *what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_utf_8_or_windows_1252_or_none() {
        assert_eq!(decoded_text("\u{b5}m".as_bytes()).unwrap(), "\u{b5}m");
        // By Unicode's table CP1252.TXT.
        assert_eq!(
            decoded_text(b"\x80 \x9f \xb5 \xb0 \xfc").unwrap(),
            "\u{20ac} \u{178} \u{b5} \u{b0} \u{fc}"
        );
        for byte in [0x81, 0x8d, 0x8f, 0x90, 0x9d] {
            assert_eq!(decoded_text(&[b'a', byte]), None, "{byte:x}");
        }
        assert_eq!(shown(b"a\x81"), "a\u{fffd}");
    }

    #[test]
    fn both_orders_of_bytes_give_the_same_text() {
        let text = "Punkt;x [\u{b5}m]\r\nP\u{1d54f};1,5\n".repeat(900);
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = std::iter::once(0xfeff)
            .chain(units.iter().copied())
            .flat_map(u16::to_le_bytes)
            .collect();
        let big: Vec<u8> = std::iter::once(0xfeff)
            .chain(units.iter().copied())
            .flat_map(u16::to_be_bytes)
            .collect();
        for bytes in [little, big] {
            assert!(is_utf16(&bytes));
            let mut read = String::new();
            without_utf16(Cursor::new(bytes))
                .expect("a reader")
                .read_to_string(&mut read)
                .expect("a text");
            assert_eq!(read, text);
        }
        let mut plain = Vec::new();
        let mut reader = without_utf16(&b"\xef\xbb\xbf\xb5m and more"[..]).expect("a reader");
        assert_eq!(reader.read(&mut [0; 99]).expect("bytes"), 11);
        reader.read_to_end(&mut plain).expect("bytes");
        assert_eq!(plain, b"");
    }

    #[test]
    fn programs_are_told_from_text_by_how_they_begin() {
        let reason = |head: &[u8]| not_read(head).unwrap_or_default();
        assert!(reason(b"/PROG  MEASURE\n/ATTR\n").contains("FANUC"));
        assert!(
            reason(b"\r\nMODULE Measure\n").contains("ABB")
                && reason(b"%%%\n  VERSION:1\n").contains("ABB")
        );
        assert!(reason(b"DEF MEASURE( )\n").contains("KUKA"));
        for text in [
            &b"MODULE,X,Y\n"[..],
            b"DEFLECTION X Y\n",
            b"name;A1;A2\n",
            b"% made by hand\n",
            b"",
        ] {
            assert_eq!(not_read(text), None);
        }
    }
}
