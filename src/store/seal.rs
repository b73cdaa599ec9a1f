//! JSON texts that carry the hash of their own bytes as their last member, so that one flipped bit anywhere shows.

use serde::Serialize;

use crate::error::{Error, Result};

const OPEN: &str = ",\n  \"sealed\": \"";
const CLOSE: &str = "\"\n}\n";
const DIGITS: usize = 64;

/// The text of a struct or map, sealed.
pub(super) fn seal(value: &impl Serialize) -> Result<Vec<u8>> {
    let bug = |why: &str| Error::Bug(format!("sealing a record: {why}"));
    let mut text = serde_json::to_vec_pretty(value).map_err(|e| bug(&e.to_string()))?;
    if !text.ends_with(b"\n}") {
        return Err(bug("it has no members"));
    }
    text.truncate(text.len() - 2);
    let hash = blake3::hash(&text).to_hex();
    text.extend_from_slice(format!("{OPEN}{hash}{CLOSE}").as_bytes());
    Ok(text)
}

/// The hash that a sealed text carries, if it is the text's own; else what is wrong.
pub(super) fn unseal(text: &[u8]) -> std::result::Result<String, &'static str> {
    let tail = OPEN.len() + DIGITS + CLOSE.len();
    let Some(split) = text.len().checked_sub(tail) else {
        return Err("it is torn");
    };
    let (body, end) = text.split_at(split);
    let carried = end
        .strip_prefix(OPEN.as_bytes())
        .and_then(|rest| rest.strip_suffix(CLOSE.as_bytes()))
        .and_then(|digits| std::str::from_utf8(digits).ok());
    match carried {
        None => Err("it has no seal at its end: it is torn, or was edited"),
        Some(carried) if carried == blake3::hash(body).to_hex().as_str() => Ok(carried.into()),
        Some(_) => Err("its content is not what was sealed"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_and_every_cut_breaks_the_seal() {
        let text = seal(&serde_json::json!({"a": 1, "b": {"c": [1.5, "x"]}})).unwrap();
        assert!(unseal(&text).is_ok());
        assert!(serde_json::from_slice::<serde_json::Value>(&text).unwrap()["sealed"].is_string());
        for bit in 0..text.len() * 8 {
            let mut flipped = text.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(unseal(&flipped).is_err(), "bit {bit}");
        }
        assert!((0..text.len()).all(|length| unseal(&text[..length]).is_err()));
    }
}
