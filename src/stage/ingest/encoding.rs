//! Bytes of a text file as letters: UTF-8, else Windows-1252, which German, French and Spanish spreadsheets and controllers write.

use std::borrow::Cow;

/// 0x80 to 0x9f of Windows-1252; zero where there is no letter. Above them it is Latin-1.
const UPPER: [u16; 32] = [
    0x20ac, 0, 0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160, 0x2039, 0x0152, 0, 0x017d, 0, 0, 0x2018,
    0x2019, 0x201c, 0x201d, 0x2022, 0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0, 0x017e, 0x0178,
];

/// The text, or nothing where the bytes are neither.
pub fn text(bytes: &[u8]) -> Option<Cow<'_, str>> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Some(Cow::Borrowed(text)),
        Err(_) => bytes.iter().map(|byte| letter(*byte)).collect::<Option<String>>().map(Cow::Owned),
    }
}

/// The text for people: what is no letter is shown as such.
pub fn shown(bytes: &[u8]) -> Cow<'_, str> {
    text(bytes).unwrap_or_else(|| String::from_utf8_lossy(bytes))
}

fn letter(byte: u8) -> Option<char> {
    let upper = byte.checked_sub(0x80).and_then(|place| UPPER.get(usize::from(place)));
    match upper {
        None => Some(char::from(byte)),
        Some(0) => None,
        Some(code) => char::from_u32(u32::from(*code)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_utf_8_or_windows_1252_or_none() {
        assert_eq!(text("\u{b5}m".as_bytes()).unwrap(), "\u{b5}m");
        // By Unicode's table CP1252.TXT.
        assert_eq!(text(b"\x80 \x9f \xb5 \xb0 \xfc").unwrap(), "\u{20ac} \u{178} \u{b5} \u{b0} \u{fc}");
        assert_eq!(text(b"a\x81"), None);
        assert_eq!(shown(b"a\x81"), "a\u{fffd}");
    }
}
