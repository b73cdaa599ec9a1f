//! Taking away what nothing keeps: action records first, then objects that no record names. Never by itself, never anything young.

use super::Store;
use super::disk::{self, refused};
use super::verify::files;
use crate::error::{Error, Result};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Letters and digits of a run's id, a ULID.
const RUN_ID: usize = 26;

/// What was swept, or would be.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Sweep {
    /// Records that go.
    pub(crate) actions: u64,
    /// Tables that go.
    pub(crate) objects: u64,
    /// Bytes of the records and tables that go.
    pub(crate) bytes: u64,
    /// Records that stay.
    pub(crate) kept_actions: u64,
    /// Tables that stay.
    pub(crate) kept_objects: u64,
    /// Kept only because they are younger than the grace period.
    pub(crate) young: u64,
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
        for path in files(&self.root().join("fleets"))?
            .iter()
            .filter(|path| path.extension().is_some_and(|end| end == "json"))
        {
            hashes_in(path, &mut named)?;
        }
        let mut gone: BTreeSet<PathBuf> = BTreeSet::new();
        for path in files(&self.root().join("actions"))? {
            let asked = |stem: &str| keep.contains(stem) || named.contains(stem);
            let kept = path
                .file_stem()
                .is_some_and(|stem| asked(&stem.to_string_lossy()));
            if kept || !old(&path, before, &mut sweep) {
                sweep.kept_actions += 1;
                continue;
            }
            sweep.actions += 1;
            sweep.bytes += remove(&path, dry_run)?;
            gone.insert(path);
        }
        for path in files(&self.root().join("actions"))?
            .iter()
            .filter(|path| !gone.contains(*path))
        {
            hashes_in(path, &mut named)?;
        }
        for path in files(&self.root().join("objects"))? {
            let damaged = path
                .extension()
                .is_some_and(|extension| extension == "damaged");
            let needed = !damaged
                && path
                    .file_stem()
                    .is_some_and(|stem| named.contains(&*stem.to_string_lossy()));
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

/// What looks like a hash in a record, also in one that cannot be read as one any more.
fn hashes_in(path: &Path, hashes: &mut BTreeSet<String>) -> Result<()> {
    let text = fs::read(path).map_err(|e| refused(path, "read", &e))?;
    let words = text
        .split(|byte| !byte.is_ascii_hexdigit())
        .filter(|word| word.len() == 64);
    hashes.extend(words.map(|word| String::from_utf8_lossy(word).into_owned()));
    Ok(())
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
    pub(crate) fn runs_of_fleets(&self) -> Result<BTreeSet<String>> {
        let mut runs = BTreeSet::new();
        for path in files(&self.root().join("fleets"))?
            .iter()
            .filter(|path| path.extension().is_some_and(|end| end == "json"))
        {
            let text = fs::read(path).map_err(|e| refused(path, "read", &e))?;
            let words = text
                .split(|byte| !byte.is_ascii_alphanumeric())
                .filter(|word| word.len() == RUN_ID);
            runs.extend(words.map(|word| String::from_utf8_lossy(word).into_owned()));
        }
        Ok(runs)
    }
}
