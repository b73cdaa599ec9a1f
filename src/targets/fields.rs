//! Fields of a line of delimited text, where they stand: what is not changed stays byte for byte.

use crate::raw::{self, Delimiter, unquoted_text};
use std::borrow::Cow;
use std::ops::Range;

/// Where a field stands, and its text without quotes.
pub(super) type TextField<'t> = (Range<usize>, Cow<'t, str>);

/// The fields of a line. Fails where a quote is not closed.
pub(super) fn fields(line: &str, delimiter: char) -> Result<Vec<TextField<'_>>, String> {
    let (places, open) = raw::fields(line, Delimiter::Byte(delimiter as u8));
    match open {
        Some(at) => Err(format!("column {}: `\"` is not closed on its line", at + 1)),
        None => Ok(places
            .into_iter()
            .map(|place| (place.clone(), unquoted_text(&line[place])))
            .collect()),
    }
}
