//! Fields of a line of delimited text, where they stand: what is not changed stays byte for byte.

use std::borrow::Cow;
use std::ops::Range;

/// Where a field stands, and its text without quotes.
pub(super) type TextField<'t> = (Range<usize>, Cow<'t, str>);

/// The fields of a line. A quote opens a field only where it begins one, behind blanks at most; inside,
/// two are one (RFC 4180). Fails where one is not closed.
pub(super) fn fields(line: &str, delimiter: char) -> Result<Vec<TextField<'_>>, String> {
    let mut out = Vec::with_capacity(16);
    let (mut start, mut quoted, mut opened) = (0, false, 0);
    let mut chars = line.char_indices().peekable();
    while let Some((at, c)) = chars.next() {
        match c {
            '"' if quoted && chars.next_if(|(_, next)| *next == '"').is_some() => {}
            '"' if quoted => quoted = false,
            '"' if line[start..at].trim().is_empty() => (quoted, opened) = (true, at),
            _ if c == delimiter && !quoted => {
                out.push((start..at, unquoted(&line[start..at])));
                start = at + c.len_utf8();
            }
            _ => {}
        }
    }
    if quoted {
        return Err(format!("column {}: `\"` is not closed on its line", opened + 1));
    }
    out.push((start..line.len(), unquoted(&line[start..])));
    Ok(out)
}

fn unquoted(text: &str) -> Cow<'_, str> {
    let text = text.trim();
    let inner = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
    if inner.contains('"') { Cow::Owned(inner.replace("\"\"", "\"")) } else { Cow::Borrowed(inner) }
}
