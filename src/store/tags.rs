//! Names for runs, `tags/<name>.json`: what is tagged is kept.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use super::Store;
use super::disk::{component, refused, replace, write_synced};
use super::seal::{seal, unseal};
use crate::error::{Error, Result};

#[derive(Serialize, Deserialize)]
struct Tag {
    run: String,
}

impl Store {
    fn tag_path(&self, name: &str) -> Result<PathBuf> {
        let name = component(name)?;
        if name.starts_with("HEAD") || name.ends_with(".json") {
            return Err(Error::spec(format!("tag {name}"), "a tag must not begin with HEAD or end in .json"));
        }
        Ok(self.root().join("tags").join(format!("{name}.json")))
    }

    /// All tags with their runs.
    pub fn tags(&self) -> Result<BTreeMap<String, String>> {
        let dir = self.root().join("tags");
        let entries = match fs::read_dir(&dir) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
            Err(e) => return Err(refused(&dir, "read", &e)),
        };
        let mut tags = BTreeMap::new();
        for path in entries.flatten().map(|entry| entry.path()) {
            let Some(name) = path.file_name().and_then(|name| name.to_str()?.strip_suffix(".json")) else { continue };
            let bytes = fs::read(&path).map_err(|e| refused(&path, "read", &e))?;
            let damaged = |why: &str| {
                Error::store(path.display().to_string(), format!("damaged: {why}; set it again with calib tag RUN {name}"))
            };
            unseal(&bytes).map_err(damaged)?;
            let tag: Tag = serde_json::from_slice(&bytes).map_err(|e| damaged(&e.to_string()))?;
            tags.insert(name.to_string(), tag.run);
        }
        Ok(tags)
    }

    /// Gives a run a name, or the name to another run.
    pub fn tag(&self, name: &str, run: &str) -> Result<()> {
        let path = self.tag_path(name)?;
        let aside = self.workspace()?.fresh();
        write_synced(&aside, &seal(&Tag { run: run.into() })?)?;
        self.give(&aside, &path)?;
        replace(&aside, &path)
    }

    /// Takes a name away; the run stays.
    pub fn untag(&self, name: &str) -> Result<()> {
        let path = self.tag_path(name)?;
        self.withdraw(&path)?;
        fs::remove_file(&path).map_err(|e| refused(&path, "remove", &e))
    }
}
