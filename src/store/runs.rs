//! The audit record of runs: `runs/<id>/manifest.json` and `events.jsonl`. Ids (ULIDs) and times are made by the caller.

use serde::Serialize;
use serde_json::Value;
use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;

use super::Store;
use super::disk::{component, make_dir, refused, replace, sync_dir, write_synced};
use crate::error::{Error, Result};

/// A run in flight.
#[derive(Debug)]
pub struct Run {
    id: String,
    dir: PathBuf,
    events: File,
}

impl Run {
    pub fn id(&self) -> &str {
        &self.id
    }
    pub fn dir(&self) -> &PathBuf {
        &self.dir
    }
    /// Appends one line of JSON.
    pub fn append_event(&mut self, event: &impl Serialize) -> Result<()> {
        let mut line = serde_json::to_vec(event).map_err(|e| Error::Bug(e.to_string()))?;
        line.push(b'\n');
        self.events.write_all(&line).map_err(|e| refused(&self.dir.join("events.jsonl"), "write", &e))
    }
}

impl Store {
    fn run_dir(&self, id: &str) -> Result<PathBuf> {
        Ok(self.root().join("runs").join(component(id)?))
    }

    /// Opens the record of a run; its manifest stands from the first moment on, so that a killed run leaves a trace.
    pub fn begin_run(&self, id: &str, manifest: &impl Serialize) -> Result<Run> {
        let dir = self.run_dir(id)?;
        let parent = self.root().join("runs");
        self.workspace()?;
        make_dir(&parent)?;
        fs::create_dir(&dir).map_err(|e| refused(&dir, "make the folder", &e))?;
        sync_dir(&parent)?;
        let path = dir.join("events.jsonl");
        let events = File::options().append(true).create(true).open(&path).map_err(|e| refused(&path, "write", &e))?;
        let run = Run { id: id.into(), dir, events };
        self.write_manifest(&run, manifest)?;
        Ok(run)
    }

    /// Replaces the manifest of a run, atomically.
    pub fn write_manifest(&self, run: &Run, manifest: &impl Serialize) -> Result<()> {
        let aside = self.workspace()?.fresh();
        let mut text = serde_json::to_vec_pretty(manifest).map_err(|e| Error::Bug(e.to_string()))?;
        text.push(b'\n');
        write_synced(&aside, &text)?;
        replace(&aside, &run.dir.join("manifest.json"))
    }

    /// Closes the record of a run.
    pub fn finish_run(&self, run: Run, manifest: &impl Serialize) -> Result<()> {
        run.events.sync_all().map_err(|e| refused(&run.dir.join("events.jsonl"), "write", &e))?;
        self.write_manifest(&run, manifest)
    }

    /// Ids of all runs, oldest first (ULIDs sort by time).
    pub fn runs(&self) -> Result<Vec<String>> {
        let dir = self.root().join("runs");
        let entries = match fs::read_dir(&dir) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(refused(&dir, "read", &e)),
        };
        let mut ids: Vec<String> = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        ids.sort();
        Ok(ids)
    }

    /// The manifest of a run, as far as it was written.
    pub fn manifest(&self, id: &str) -> Result<Value> {
        let path = self.run_dir(id)?.join("manifest.json");
        let bytes = fs::read(&path).map_err(|e| refused(&path, "read", &e))?;
        serde_json::from_slice(&bytes).map_err(|e| Error::store(path.display().to_string(), format!("not a whole manifest: {e}")))
    }
}
