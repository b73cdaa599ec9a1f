//! A text file among the settings.

use super::{Context, RawFile};
use crate::error::{Error, Result};
use std::io::Read;

/// The label and content of a file that should hold `what` in at most so many bytes.
pub(super) fn text(
    file: &RawFile,
    what: &str,
    most: u64,
    context: &Context,
) -> Result<(String, String)> {
    let source = context.services.open(file)?;
    let mut bytes = Vec::new();
    source
        .reader
        .take(most + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| Error::store(&source.label, e.to_string()))?;
    if bytes.len() as u64 > most {
        return Err(Error::spec(
            &source.label,
            format!("longer than {} MB; expected {what}", most >> 20),
        ));
    }
    let text = String::from_utf8(bytes).map_err(|_| {
        Error::spec(
            &source.label,
            format!("not a text file in UTF-8; expected {what}"),
        )
    })?;
    Ok((source.label, text))
}
