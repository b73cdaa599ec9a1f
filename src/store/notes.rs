//! Notes below the store that are no tables: small sealed JSON files, and parts of inputs, put in place whole.

use serde::Serialize;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

use super::Store;
use super::disk::{component, place, put_if_absent, refused, replace, write, write_synced};
use super::seal::{seal, unseal};
use crate::error::{Error, Result};

impl Store {
    /// Where a note lies; fails where a part of its place cannot be a file name.
    pub fn place_of_note(&self, place: &[&str], name: &str) -> Result<PathBuf> {
        let mut path = self.root().to_path_buf();
        for part in place.iter().chain([&name]) {
            path.push(component(part)?);
        }
        Ok(path)
    }

    /// A note, where there is one. A torn or damaged one is none.
    pub fn note(&self, place: &[&str], name: &str) -> Result<Option<Value>> {
        let path = self.place_of_note(place, name)?;
        match fs::read(&path) {
            Ok(bytes) => Ok(read(&bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(refused(&path, "read", &error)),
        }
    }

    /// Writes a note over what may be there, durably.
    pub fn put_note(&self, place: &[&str], name: &str, note: &impl Serialize) -> Result<()> {
        let path = self.place_of_note(place, name)?;
        let aside = self.workspace()?.fresh();
        write_synced(&aside, &text(note)?)?;
        replace(&aside, &path)
    }

    /// Writes a note if there is none, durable after the next `sync`; false where one stands.
    pub fn put_note_once(&self, place: &[&str], name: &str, note: &impl Serialize) -> Result<bool> {
        let path = self.place_of_note(place, name)?;
        let aside = self.workspace()?.fresh();
        let file = write(&aside, &text(note)?)?;
        let fresh = put_if_absent(&aside, &path)?;
        let _ = fs::remove_file(&aside);
        if fresh {
            self.owe(&path, file)?;
        }
        Ok(fresh)
    }

    /// Writes a file over what may be there, durable after the next `sync`.
    pub fn put_file(&self, folder: &[&str], name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.place_of_note(folder, name)?;
        let aside = self.workspace()?.fresh();
        let file = write(&aside, bytes)?;
        place(&aside, &path)?;
        self.owe(&path, file)
    }

    /// Takes a note away; nothing where there is none.
    pub fn drop_note(&self, place: &[&str], name: &str) -> Result<()> {
        let path = self.place_of_note(place, name)?;
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(refused(&path, "remove", &error))
            }
            _ => Ok(()),
        }
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
