//! Everything in a store read and rehashed: objects by their names, records and manifests by their seals, the copies for people.

use crate::actions::ActionRecord;
use crate::disk::{ends_in, entries, refused};
use crate::error::{Error, Fault, Result};
use crate::key::FileHash;
use crate::notes::unseal;
use crate::runs::{Sealed, events_fault};
use crate::{Store, disk};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What a verification read, and everything that it found wrong.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Verification {
    /// Number of tables.
    pub objects: u64,
    /// Bytes of the tables.
    pub bytes: u64,
    /// Number of records of what stages made.
    pub actions: u64,
    /// Number of runs.
    pub runs: u64,
    /// Names that were followed.
    pub tags: u64,
    /// Files below `tables/` and `documents/`.
    pub copies: u64,
    /// Sealed notes of documents and fleets.
    pub notes: u64,
    /// What is not as it was written.
    #[serde(serialize_with = "texts")]
    pub faults: Vec<Fault>,
}

fn texts<S: serde::Serializer>(
    faults: &[Fault],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_seq(faults.iter().map(Fault::to_string))
}

impl Store {
    /// Reads and rehashes every file; of a bucket everything is fetched anew.
    pub fn verify(&self) -> Result<Verification> {
        if let Some(copy) = self.copy()? {
            return self.verify_copy(&copy);
        }
        let mut found = Verification::default();
        let format = self.root().join("format.json");
        if fs::read(&format).map_err(|e| refused(&format, "read", &e))? != super::format_text()? {
            found.faults.push(fault(
                &format,
                "is not what was written; restore it: {\"calib_store\":1}",
            ));
        }
        let objects = self.check_objects(&mut found)?;
        let mut known: BTreeSet<String> = objects.keys().cloned().collect();
        self.check_actions(&objects, &mut found)?;
        self.check_runs(&mut known, &mut found)?;
        match self.tags() {
            Ok(tags) => {
                found.tags = tags.len() as u64;
                let runs = self.runs()?;
                for (tag, run) in tags.into_iter().filter(|(_, run)| !runs.contains(run)) {
                    found.faults.push(Fault::new(
                        format!("tag {tag}"),
                        format!("names the run {run}, which is not there"),
                    ));
                }
            }
            Err(Error::Store(tag)) => found.faults.push(tag),
            Err(other) => return Err(other),
        }
        let advice =
            "is no table that a run wrote: it was edited or is damaged; calib run writes it anew";
        for path in files(&self.root().join("tables"))? {
            found.copies += 1;
            if !known.contains(hash(&path)?.0.as_str()) {
                found.faults.push(fault(&path, advice));
            }
        }
        self.check_documents(&mut found)?;
        for path in self.fleet_notes()? {
            found.notes += 1;
            if let Err(why) = unseal(&read(&path)?) {
                let why = format!("{why}; calib fleet run writes it anew");
                found.faults.push(fault(&path, &why));
            }
        }
        Ok(found)
    }

    /// Objects by name, with whether they are whole.
    fn check_objects(&self, found: &mut Verification) -> Result<BTreeMap<String, bool>> {
        let paths = files(&self.root().join("objects"))?;
        let hashes: Vec<(PathBuf, Result<(FileHash, u64)>)> = paths
            .par_iter()
            .map(|path| (path.clone(), hash(path)))
            .collect();
        let mut objects = BTreeMap::new();
        for (path, hashed) in hashes {
            let name = stem(&path);
            let (hash, bytes) = hashed?;
            found.objects += 1;
            found.bytes += bytes;
            let whole = hash.as_str() == name && ends_in(&path, "parquet");
            if ends_in(&path, "damaged") {
                found.faults.push(fault(
                    &path,
                    "was set aside as damaged; calib gc takes it away",
                ));
            } else if !whole {
                found.faults.push(fault(
                    &path,
                    "its bytes are not those that were published; calib run makes it anew where it is needed",
                ));
            }
            objects.insert(name, whole);
        }
        Ok(objects)
    }

    fn check_actions(
        &self,
        objects: &BTreeMap<String, bool>,
        found: &mut Verification,
    ) -> Result<()> {
        for path in files(&self.root().join("actions"))? {
            found.actions += 1;
            let record = match read_record(&path)? {
                Ok(record) => record,
                Err(why) => {
                    found.faults.push(fault(
                        &path,
                        &format!("{why}; calib run makes it anew where it is needed"),
                    ));
                    continue;
                }
            };
            for (port, table) in &record.tables {
                if !objects.contains_key(table.file_hash.as_str()) {
                    found.faults.push(fault(
                        &path,
                        &format!(
                            "its table {port} is missing from the objects; calib run makes it anew"
                        ),
                    ));
                }
            }
        }
        Ok(())
    }

    fn check_runs(&self, known: &mut BTreeSet<String>, found: &mut Verification) -> Result<()> {
        let mut seals: BTreeMap<String, Option<String>> = BTreeMap::new();
        let mut links: Vec<(String, serde_json::Value)> = Vec::new();
        for run in self.runs()? {
            found.runs += 1;
            let path = self.root().join("runs").join(&run);
            let (manifest, sealed) = match self.sealed_manifest(&run) {
                Ok(Sealed { manifest, sealed }) => (manifest, sealed),
                Err(Error::Store(why)) => {
                    seals.insert(run, None);
                    found.faults.push(why);
                    continue;
                }
                Err(other) => return Err(other),
            };
            if manifest["run_id"] != run.as_str() {
                found.faults.push(fault(
                    &path.join("manifest.json"),
                    "is the manifest of another run",
                ));
            }
            let events = path.join("events.jsonl");
            match fs::read(&events) {
                Ok(text) => {
                    let ended = manifest["status"] != "running";
                    found
                        .faults
                        .extend(events_fault(&text, ended).map(|why| fault(&events, &why)));
                }
                // A run may be killed between its manifest and its first event.
                Err(e)
                    if e.kind() == std::io::ErrorKind::NotFound
                        && manifest["status"] == "running" => {}
                Err(e) => found
                    .faults
                    .push(fault(&events, &format!("cannot be read: {e}"))),
            }
            for output in manifest["stages"]
                .as_array()
                .into_iter()
                .flatten()
                .flat_map(|stage| stage["outputs"].as_array().into_iter().flatten())
            {
                known.extend(output["file_hash"].as_str().map(String::from));
            }
            links.push((run.clone(), manifest["previous"].clone()));
            seals.insert(run, Some(sealed));
        }
        for (run, previous) in links.iter().filter(|(_, previous)| !previous.is_null()) {
            let (before, sealed) = (
                previous["run"].as_str().unwrap_or_default(),
                previous["sealed"].as_str(),
            );
            let why = match seals.get(before) {
                None => format!("the preceding run {before} is missing"),
                // A broken seal is a fault of its own already.
                Some(None) => continue,
                Some(Some(found)) if Some(found.as_str()) == sealed => continue,
                Some(Some(_)) => format!(
                    "the manifest of the preceding run {before} has changed since this run began"
                ),
            };
            found.faults.push(Fault::new(format!("run {run}"), why));
        }
        Ok(())
    }

    /// Documents against the hashes that were noted when they were written.
    fn check_documents(&self, found: &mut Verification) -> Result<()> {
        let (documents, seals) = (self.root().join("documents"), self.root().join("seals"));
        let advice = "is not the document that was written; calib run writes it anew";
        let mut sealed: BTreeSet<PathBuf> = BTreeSet::new();
        for path in files(&seals)? {
            found.notes += 1;
            let text = read(&path)?;
            let whole = unseal(&text)
                .ok()
                .and_then(|_| serde_json::from_slice::<serde_json::Value>(&text).ok());
            let named = path
                .strip_prefix(&seals)
                .ok()
                .map(|name| documents.join(name.with_extension("")));
            let (Some(note), Some(document)) = (whole, named) else {
                found
                    .faults
                    .push(fault(&path, "is damaged; calib run writes it anew"));
                continue;
            };
            found.copies += 1;
            match hash(&document) {
                Ok((hash, _)) if note["blake3"] == hash.as_str() => {}
                Ok(_) => found.faults.push(fault(&document, advice)),
                Err(_) => found
                    .faults
                    .push(fault(&document, "is gone; calib run writes it anew")),
            }
            sealed.insert(document);
        }
        let unsealed = files(&documents)?
            .into_iter()
            .filter(|path| !sealed.contains(path));
        found
            .faults
            .extend(unsealed.map(|path| fault(&path, "is no document that calib wrote")));
        Ok(())
    }

    /// Verifies a copy of the bucket. Tables that the bucket does not hold whole are forgotten here, so that the next run makes them anew.
    fn verify_copy(&self, copy: &Path) -> Result<Verification> {
        let mut found = match Store::open(copy) {
            Ok(store) => store.verify()?,
            Err(Error::Store(fault)) => Verification {
                faults: vec![fault],
                ..Verification::default()
            },
            Err(other) => return Err(other),
        };
        let (prefix, name) = (copy.display().to_string(), self.name());
        for fault in &mut found.faults {
            if let Ok(key) = Path::new(&fault.place).strip_prefix(copy)
                && key.starts_with("objects")
            {
                let _ = fs::remove_file(self.root().join(key));
            }
            (fault.place, fault.message) = (
                fault.place.replace(&prefix, &name),
                fault.message.replace(&prefix, &name),
            );
        }
        fs::remove_dir_all(copy).map_err(|e| refused(copy, "remove", &e))?;
        Ok(found)
    }

    /// Every action record that can be read.
    pub fn records(&self) -> Result<Vec<ActionRecord>> {
        self.refresh_all("actions/")?;
        let mut records = Vec::new();
        for path in files(&self.root().join("actions"))? {
            records.extend(read_record(&path)?.ok());
        }
        Ok(records)
    }
}

fn read_record(path: &Path) -> Result<std::result::Result<ActionRecord, String>> {
    let bytes = read(path)?;
    let sealed = unseal(&bytes).map_err(String::from);
    let record: std::result::Result<ActionRecord, String> = sealed.and_then(|_| {
        serde_json::from_slice(&bytes).map_err(|e| format!("not an action record ({e})"))
    });
    Ok(record.and_then(|record| {
        let is_named = stem(path) == record.id.as_str() && record.key.id() == record.id;
        is_named
            .then_some(record)
            .ok_or_else(|| "the record is not of the key that its name says".into())
    }))
}

fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).map_err(|e| refused(path, "read", &e))
}

/// A file's name without its extension.
fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}

fn fault(path: &Path, why: &str) -> Fault {
    Fault::new(path.display().to_string(), why)
}

fn hash(path: &Path) -> Result<(FileHash, u64)> {
    let read = || {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        Ok((FileHash::of_reader(file)?, bytes))
    };
    read().map_err(|e: std::io::Error| refused(path, "read", &e))
}

/// All files below a folder, in order of their paths; none where it is not there.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() {
            found.extend(files(&path)?);
        } else {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Letters and digits of a run's id, a ULID.
const RUN_ID: usize = 26;
/// Hex digits of a hash.
const HASH: usize = 64;

/// What was swept, or would be.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Sweep {
    /// Number of records of what stages made.
    pub actions: u64,
    /// Number of tables.
    pub objects: u64,
    /// Bytes of the records and tables that go.
    pub bytes: u64,
    /// Records that stay.
    pub kept_actions: u64,
    /// Tables that stay.
    pub kept_objects: u64,
    /// Kept only because they are younger than the grace period.
    pub young: u64,
}

impl Store {
    /// Takes away the records of actions that are neither in `keep` nor named by a fleet, the objects that neither a record nor a fleet names then,
    /// and what was set aside as damaged; of all these only what was last changed before `before`. Refuses while a run is in flight.
    pub fn sweep(
        &self,
        keep: &BTreeSet<String>,
        before: SystemTime,
        dry_run: bool,
    ) -> Result<Sweep> {
        if self.in_bucket() {
            return Err(Error::spec(
                self.name(),
                "a store in a bucket cannot be swept: copy it to a folder, run calib gc there and copy it back",
            ));
        }
        if !dry_run && disk::in_use(&self.root().join("tmp")) {
            let message = "a run is in flight in this store: sweep when it has ended";
            return Err(Error::store(self.root().display().to_string(), message));
        }
        let mut sweep = Sweep::default();
        let mut named: BTreeSet<String> = BTreeSet::new();
        for path in self.fleet_notes()? {
            named.extend(words(&path, HASH, |byte| byte.is_ascii_hexdigit())?);
        }
        let mut stay = Vec::new();
        for path in files(&self.root().join("actions"))? {
            let id = stem(&path);
            if keep.contains(&id) || named.contains(&id) || !old(&path, before, &mut sweep) {
                sweep.kept_actions += 1;
                stay.push(path);
                continue;
            }
            sweep.actions += 1;
            sweep.bytes += remove(&path, dry_run)?;
        }
        // Also in a record that cannot be read as one any more.
        for path in stay {
            named.extend(words(&path, HASH, |byte| byte.is_ascii_hexdigit())?);
        }
        for path in files(&self.root().join("objects"))? {
            let needed = !ends_in(&path, "damaged") && named.contains(&stem(&path));
            if needed || !old(&path, before, &mut sweep) {
                sweep.kept_objects += 1;
                continue;
            }
            sweep.objects += 1;
            sweep.bytes += remove(&path, dry_run)?;
        }
        Ok(sweep)
    }
}

/// What looks like a hash, or the id of a run, in a file: words of so many of some letters.
fn words(path: &Path, letters: usize, is_letter: fn(&u8) -> bool) -> Result<Vec<String>> {
    let text = read(path)?;
    let words = text.split(|byte| !is_letter(byte));
    Ok(words
        .filter(|word| word.len() == letters)
        .map(|word| String::from_utf8_lossy(word).into_owned())
        .collect())
}

/// True where a file was last changed before `before`; a time that lies in the future counts as young.
fn old(path: &Path, before: SystemTime, sweep: &mut Sweep) -> bool {
    let old = fs::metadata(path)
        .and_then(|metadata| metadata.modified())
        .is_ok_and(|time| time < before);
    sweep.young += u64::from(!old);
    old
}

fn remove(path: &Path, dry_run: bool) -> Result<u64> {
    let bytes = fs::metadata(path)
        .map(|metadata| metadata.len())
        .unwrap_or(0);
    if !dry_run {
        fs::remove_file(path).map_err(|e| refused(path, "remove", &e))?;
    }
    Ok(bytes)
}

impl Store {
    /// Runs that the records of fleets name.
    pub fn runs_of_fleets(&self) -> Result<BTreeSet<String>> {
        let mut runs = BTreeSet::new();
        for path in self.fleet_notes()? {
            runs.extend(words(&path, RUN_ID, |byte| byte.is_ascii_alphanumeric())?);
        }
        Ok(runs)
    }

    fn fleet_notes(&self) -> Result<Vec<PathBuf>> {
        let mut notes = files(&self.root().join("fleets"))?;
        notes.retain(|path| ends_in(path, "json"));
        Ok(notes)
    }
}
