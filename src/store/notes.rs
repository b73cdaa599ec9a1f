//! Notes below the store that are no tables: small sealed JSON files, and parts of inputs, put in place whole.

use super::Store;
use super::disk::{component, place, refused, remove};
use super::key::TableRef;
use crate::error::{Error, Result};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

impl Store {
    /// Where a note lies; fails where a part of its place cannot be a file name.
    pub fn place_of_note(&self, place: &[&str], name: &str) -> Result<PathBuf> {
        let mut path = self.root().to_path_buf();
        for part in place.iter().chain([&name]) {
            path.push(component(part)?);
        }
        Ok(path)
    }

    /// A note, where there is one. One that is torn, damaged or of another kind is none.
    pub fn note<T: DeserializeOwned>(&self, place: &[&str], name: &str) -> Result<Option<T>> {
        let bytes = super::disk::read(&self.place_of_note(place, name)?)?;
        let note = bytes.and_then(|bytes| read(&bytes));
        Ok(note.and_then(|note| serde_json::from_value(note).ok()))
    }

    /// Writes a note over what may be there, durably.
    pub fn put_note(&self, place: &[&str], name: &str, note: &impl Serialize) -> Result<()> {
        self.put_now(&self.place_of_note(place, name)?, &text(note)?)
    }

    /// Writes a note if there is none, durable after the next `sync`; false where one stands.
    pub fn put_note_once(&self, place: &[&str], name: &str, note: &impl Serialize) -> Result<bool> {
        self.put_once(&self.place_of_note(place, name)?, &text(note)?)
    }

    /// Writes a file over what may be there, durable after the next `sync`.
    pub fn put_file(&self, folder: &[&str], name: &str, bytes: &[u8]) -> Result<()> {
        self.put(&self.place_of_note(folder, name)?, bytes)
    }

    /// Takes a note away; nothing where there is none.
    pub fn drop_note(&self, place: &[&str], name: &str) -> Result<()> {
        remove(&self.place_of_note(place, name)?)
    }
}

/// What is no struct or map is put into one, so that it can be sealed.
const LIST: &str = "list";

fn text(note: &impl Serialize) -> Result<Vec<u8>> {
    let value = serde_json::to_value(note).map_err(|error| Error::Bug(error.to_string()))?;
    match value {
        Value::Object(_) => seal(&value),
        other => seal(&serde_json::json!({ LIST: other })),
    }
}

fn read(bytes: &[u8]) -> Option<Value> {
    unseal(bytes).ok()?;
    let mut value: Value = serde_json::from_slice(bytes).ok()?;
    let members = value.as_object_mut()?;
    members.remove("sealed");
    if members.len() == 1 && members.contains_key(LIST) {
        members.remove(LIST)
    } else {
        Some(value)
    }
}

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
        .and_then(|after| after.strip_suffix(CLOSE.as_bytes()))
        .and_then(|digits| std::str::from_utf8(digits).ok());
    match carried {
        None => Err("it has no seal at its end: it is torn, or was edited"),
        Some(carried) if carried == blake3::hash(body).to_hex().as_str() => Ok(carried.into()),
        Some(_) => Err("its content is not what was sealed"),
    }
}

impl Store {
    /// Shows a table as `tables/<pipeline>/<stage>.<port>.parquet`: another name of the object, or a copy where links cannot be.
    pub fn expose(
        &self,
        pipeline: &str,
        stage: &str,
        port: &str,
        table: &TableRef,
    ) -> Result<PathBuf> {
        let name = format!("{}.{}.parquet", component(stage)?, component(port)?);
        let path = self.place_of_note(&["tables", pipeline], &name)?;
        let object = self.object_path(table);
        let aside = self.workspace()?.fresh();
        if fs::hard_link(&object, &aside).is_err() {
            fs::copy(&object, &aside).map_err(|e| refused(&aside, "copy", &e))?;
        }
        // Not synced: after a power cut the next run shows it again, and a sync of every name is a third of a small run's time.
        place(&aside, &path)?;
        Ok(path)
    }

    /// Whether a table of a stage was ever shown.
    pub fn shown(&self, pipeline: &str, stage: &str) -> bool {
        let opening = format!("{stage}.");
        let entries = fs::read_dir(self.root().join("tables").join(pipeline))
            .into_iter()
            .flatten()
            .flatten();
        entries
            .into_iter()
            .any(|entry| entry.file_name().to_string_lossy().starts_with(&opening))
    }

    /// Writes a document (a report) as `documents/<pipeline>/<name>`, and its hash as `seals/<pipeline>/<name>.json`.
    pub fn expose_document(&self, pipeline: &str, name: &str, content: &[u8]) -> Result<PathBuf> {
        let path = self.place_of_note(&["documents", pipeline], name)?;
        self.put(&path, content)?;
        // Afterwards: a crash in between is mended by the next run, which writes both again.
        let hash = serde_json::json!({ "blake3": blake3::hash(content).to_hex().as_str() });
        self.put_file(&["seals", pipeline], &format!("{name}.json"), &seal(&hash)?)?;
        Ok(path)
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
