//! The audit record of runs: `runs/<id>/manifest.json` and `events.jsonl`. Ids (ULIDs) and times are made by the caller.
//!
//! Names for runs, `tags/<name>.json`: what is tagged is kept.

use super::disk::{component, entries, make_dir, place, refused};
use super::notes::{seal, unseal};
use super::{KnownRuns, Store};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;
use std::sync::{MutexGuard, PoisonError};

/// A run in flight.
#[derive(Debug)]
pub struct Run {
    dir: PathBuf,
    events: File,
    chain: blake3::Hasher,
}

/// A run and the seal of its manifest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Link {
    /// Id of the run.
    pub run: String,
    /// Hex digits of the seal.
    pub sealed: String,
}

/// A manifest whose seal holds.
#[derive(Debug, Clone)]
pub struct Sealed {
    /// As it was written.
    pub manifest: Value,
    /// Hex digits of the seal.
    pub sealed: String,
}

/// Hex digits of the hash that an event carries.
const EVENT_DIGITS: usize = 16;

impl Run {
    /// Its folder.
    pub fn dir(&self) -> &PathBuf {
        &self.dir
    }
    /// Appends one line of JSON.
    pub fn append_event(&mut self, event: &impl Serialize) -> Result<()> {
        let mut line = serde_json::to_vec(event).map_err(|e| Error::Bug(e.to_string()))?;
        line.pop();
        self.chain.update(&line);
        let hash = &self.chain.finalize().to_hex()[..EVENT_DIGITS];
        line.extend_from_slice(format!(",\"chain\":\"{hash}\"}}\n").as_bytes());
        self.events
            .write_all(&line)
            .map_err(|e| refused(&self.dir.join("events.jsonl"), "write", &e))
    }
}

/// What is wrong with the events of a run, if anything; the last line of a run that was killed may be torn.
pub fn events_fault(text: &[u8], ended: bool) -> Option<String> {
    let mut chain = blake3::Hasher::new();
    let mut lines = text
        .split_inclusive(|&byte| byte == b'\n')
        .enumerate()
        .peekable();
    while let Some((number, line)) = lines.next() {
        let tail = EVENT_DIGITS + "\"}\n".len();
        let known = line
            .len()
            .checked_sub(tail + ",\"chain\":\"".len())
            .map(|at| line.split_at(at));
        let whole = known.is_some_and(|(body, end)| {
            chain.update(body);
            end == format!(
                ",\"chain\":\"{}\"}}\n",
                &chain.finalize().to_hex()[..EVENT_DIGITS]
            )
            .as_bytes()
        });
        let torn = !ended && lines.peek().is_none() && !line.contains(&b'}');
        if !whole && !torn {
            return Some(format!("event {} is not what was written", number + 1));
        }
    }
    None
}

impl Store {
    fn run_dir(&self, id: &str) -> Result<PathBuf> {
        Ok(self.root().join("runs").join(component(id)?))
    }

    /// Takes an id that comes after those of all runs, also where the clock went backwards: `fresh`, or one after the last. One
    /// that was reserved already is given again.
    pub fn reserve_run(&self, fresh: &str) -> Result<String> {
        self.workspace()?;
        make_dir(&self.root().join("runs"))?;
        let reserved =
            fs::read_dir(self.run_dir(fresh)?).is_ok_and(|mut entries| entries.next().is_none());
        if reserved {
            return Ok(fresh.into());
        }
        let after = |id: &str| {
            let id = ulid::Ulid::from_string(id).ok()?;
            Some(id.increment().ok()?.to_string())
        };
        let mut known = self.known_runs();
        if known.last.is_none() {
            known.last = self.run_folders()?.pop();
        }
        let mut id = fresh.to_string();
        if let Some(last) = known.last.as_deref().filter(|last| **last >= *id) {
            id = after(last).unwrap_or(id);
        }
        loop {
            let dir = self.run_dir(&id)?;
            match fs::create_dir(&dir) {
                Ok(()) => {
                    known.last = Some(id.clone());
                    return Ok(id);
                }
                // Another run took it in this moment.
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
                    id = after(&id).ok_or_else(|| refused(&dir, "make the folder", &e))?;
                }
                Err(e) => return Err(refused(&dir, "make the folder", &e)),
            }
        }
    }

    fn known_runs(&self) -> MutexGuard<'_, KnownRuns> {
        self.runs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens the record of a run whose id was reserved; its manifest stands from then on (durable after the next `sync`), so that a
    /// killed run leaves a trace. Where that fails nothing is left.
    pub fn begin_run(&self, id: &str, manifest: &impl Serialize) -> Result<Run> {
        let dir = self.run_dir(id)?;
        self.workspace()?;
        make_dir(&dir)?;
        if dir.join("manifest.json").exists() {
            return Err(Error::Bug(format!("run {id} was begun already")));
        }
        let begin = || {
            let (path, stands) = (dir.join("events.jsonl"), dir.join("manifest.json"));
            if !self.put_once(&stands, &seal(manifest)?)? {
                let message = "another run has this id: run again";
                return Err(Error::store(self.label(&stands), message));
            }
            let events = File::options()
                .append(true)
                .create(true)
                .open(&path)
                .map_err(|e| refused(&path, "write", &e))?;
            self.owe_folder(&self.root().join("runs"));
            Ok(Run {
                dir: dir.clone(),
                events,
                chain: blake3::Hasher::new(),
            })
        };
        begin().inspect_err(|_| drop(fs::remove_dir_all(&dir)))
    }

    /// Replaces the manifest of a run, atomically.
    pub fn write_manifest(&self, run: &Run, manifest: &impl Serialize) -> Result<()> {
        let events = run.dir.join("events.jsonl");
        self.give(&events, &events)?;
        self.put_now(&run.dir.join("manifest.json"), &seal(manifest)?)
    }

    /// Closes the record of a run: everything that it made is durable before its last manifest is seen, and that then; of one among many,
    /// of which the record of each says that it is done, with the next `sync`.
    pub fn finish_run(&self, run: Run, manifest: &impl Serialize, among_many: bool) -> Result<()> {
        let path = run.dir.join("manifest.json");
        let events = run.dir.join("events.jsonl");
        let text = seal(manifest)?;
        self.give(&events, &events)?;
        self.owe(&events, run.events)?;
        if among_many {
            self.put(&path, &text)?;
        } else {
            let (aside, file) = self.workspace()?.write(&text)?;
            self.give(&aside, &path)?;
            self.owe(&aside, file)?;
            self.sync_then(|| place(&aside, &path).map(|()| Some(path)))?;
        }
        let id = run.dir.file_name().map(|id| id.to_string_lossy().into());
        let link = |(run, sealed)| Link { run, sealed };
        self.known_runs().ended = id.zip(unseal(&text).ok()).map(link);
        Ok(())
    }

    /// Folders of runs by name, also of those that did not begin.
    pub(super) fn run_folders(&self) -> Result<Vec<String>> {
        let found = entries(&self.root().join("runs"))?;
        let names = found.iter().filter_map(|path| path.file_name()?.to_str());
        let mut names: Vec<String> = names.map(String::from).collect();
        names.sort();
        Ok(names)
    }

    /// Ids of all runs, oldest first (ULIDs sort by time).
    pub fn runs(&self) -> Result<Vec<String>> {
        // A folder without anything is a run that was killed before it began; a power cut may leave a file without anything, too.
        let begun = |run: &String| {
            let dir = self.root().join("runs").join(run);
            let has = |name: &&str| fs::metadata(dir.join(name)).is_ok_and(|file| file.len() > 0);
            ["manifest.json", "events.jsonl"].iter().any(has)
        };
        Ok(self.run_folders()?.into_iter().filter(begun).collect())
    }

    /// The last run whose manifest is whole and says that it ended.
    pub fn last_ended(&self) -> Result<Option<Link>> {
        if let Some(link) = &self.known_runs().ended {
            return Ok(Some(link.clone()));
        }
        for run in self.run_folders()?.into_iter().rev() {
            // A manifest that is not there or cannot be read is found by a verification; it must not stop a run.
            if let Ok(Sealed { manifest, sealed }) = self.sealed_manifest(&run)
                && manifest["status"] != "running"
            {
                return Ok(Some(Link { run, sealed }));
            }
        }
        Ok(None)
    }

    /// Whether anything of a run's manifest was written: a power cut may leave a run without, which then never ended.
    pub fn has_manifest(&self, id: &str) -> bool {
        self.run_dir(id).is_ok_and(|dir| {
            fs::metadata(dir.join("manifest.json")).is_ok_and(|file| file.len() > 0)
        })
    }

    /// The events of a run, oldest first, as far as they were written; none where they cannot be read.
    pub fn events(&self, id: &str) -> Vec<Value> {
        let text = self
            .run_dir(id)
            .ok()
            .and_then(|dir| fs::read(dir.join("events.jsonl")).ok())
            .unwrap_or_default();
        text.split(|byte| *byte == b'\n')
            .filter_map(|line| serde_json::from_slice(line).ok())
            .collect()
    }

    /// The manifest of a run, as far as it was written.
    pub fn manifest(&self, id: &str) -> Result<Value> {
        self.sealed_manifest(id).map(|found| found.manifest)
    }

    /// The manifest of a run with its seal, which holds.
    pub fn sealed_manifest(&self, id: &str) -> Result<Sealed> {
        let path = self.run_dir(id)?.join("manifest.json");
        let bytes = fs::read(&path).map_err(|e| refused(&path, "read", &e))?;
        let damaged = |why: String| {
            Error::store(
                path.display().to_string(),
                format!("not a whole manifest: {why}"),
            )
        };
        let sealed = unseal(&bytes).map_err(|why| damaged(why.into()))?;
        let manifest = serde_json::from_slice(&bytes).map_err(|e| damaged(e.to_string()))?;
        Ok(Sealed { manifest, sealed })
    }
}

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
        let mut tags = BTreeMap::new();
        for path in entries(&self.root().join("tags"))? {
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
        self.put_now(&path, &seal(&Tag { run: run.into() })?)?;
        Ok(before)
    }

    /// Takes a name away; the run stays.
    pub fn untag(&self, name: &str) -> Result<()> {
        let path = self.tag_path(name)?;
        self.withdraw(&path)?;
        fs::remove_file(&path).map_err(|e| refused(&path, "remove", &e))
    }
}
