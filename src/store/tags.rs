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
            return Err(Error::spec(
                format!("tag {name}"),
                "a tag must not begin with HEAD or end in .json",
            ));
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
            let Some(name) = path
                .file_name()
                .and_then(|name| name.to_str()?.strip_suffix(".json"))
            else {
                continue;
            };
            let bytes = fs::read(&path).map_err(|e| refused(&path, "read", &e))?;
            let damaged = |why: &str| {
                Error::store(
                    path.display().to_string(),
                    format!("damaged: {why}; set it again with calib tag RUN {name}"),
                )
            };
            unseal(&bytes).map_err(damaged)?;
            let tag: Tag = serde_json::from_slice(&bytes).map_err(|e| damaged(&e.to_string()))?;
            tags.insert(name.to_string(), tag.run);
        }
        Ok(tags)
    }

    /// Gives a run a name, or the name to another run; gives the run that had it before, where that can be read.
    pub fn tag(&self, name: &str, run: &str) -> Result<Option<String>> {
        let path = self.tag_path(name)?;
        // Ids are found in small letters, too.
        if ulid::Ulid::from_string(&name.to_ascii_uppercase()).is_ok() {
            let message = "has the form of a run's id and would hide that run; allowed: any other name, e.g. `released`";
            return Err(Error::spec(format!("tag {name}"), message));
        }
        let before = fs::read(&path).ok().filter(|bytes| unseal(bytes).is_ok());
        let before = before.and_then(|bytes| Some(serde_json::from_slice::<Tag>(&bytes).ok()?.run));
        let aside = self.workspace()?.fresh();
        write_synced(&aside, &seal(&Tag { run: run.into() })?)?;
        self.give(&aside, &path)?;
        replace(&aside, &path)?;
        Ok(before)
    }

    /// Takes a name away; the run stays.
    pub fn untag(&self, name: &str) -> Result<()> {
        let path = self.tag_path(name)?;
        self.withdraw(&path)?;
        fs::remove_file(&path).map_err(|e| refused(&path, "remove", &e))
    }
}
