//! A store in a bucket. The bucket holds what is true, under the paths of a store's files; the folder before it holds what was fetched.
//!
//! Everything is written to the bucket first and in the folder second: objects, then the action record if none stands, then manifests.
//! So a killed machine leaves nothing visible by half, and another one goes on where it stopped. Runs and tags are fetched when the
//! store is opened, records when they are looked up, tables when they are needed; what does not have the hash of its name is not taken.
//! What is for people (`tables/`, `documents/`) lies in the folder alone, where every run puts it.

use super::Store;
use super::disk::{
    component, make_dir, make_read_only, place, put_if_absent, refused, remove, together,
};
use super::key::{TableRef, same_bytes};
use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{fs, thread};

/// How often and at which distance a record is asked for that was there and is not: another machine's is being decided just now.
const TRIES: u32 = 5;
const PAUSE: Duration = Duration::from_millis(200);
/// More than any store has.
const ALL: usize = usize::MAX;
/// Folders that the bucket has, too.
const SHARED: [&str; 4] = ["objects", "actions", "runs", "tags"];

/// Whole files under keys with slashes, as S3 has them; what is written is seen by all at once.
pub trait Bucket: Debug + Send + Sync {
    /// As a person writes it: `s3://bucket/prefix`.
    fn name(&self) -> &str;
    /// Fetches into a new file; false where there is nothing.
    fn fetch(&self, key: &str, to: &Path) -> Result<bool>;
    /// Writes a file over what may be there.
    fn send(&self, from: &Path, key: &str) -> Result<()>;
    /// Writes a small file where nothing is, decided once for all who try; false where something is.
    fn create(&self, from: &Path, key: &str) -> Result<bool>;
    /// Takes away; nothing where there is nothing.
    fn remove(&self, key: &str) -> Result<()>;
    /// Keys below a folder (all where it is empty) with their bytes, in order, `most` at most.
    fn list(&self, folder: &str, most: usize) -> Result<Vec<(String, u64)>>;
}

#[derive(Debug)]
pub(super) struct Remote {
    bucket: Arc<dyn Bucket>,
    /// The bucket says that it is a store; before the first write it need not.
    begun: AtomicBool,
}

impl Store {
    /// Opens the store in a bucket with the folder before it, and makes the folder's runs and tags those of the bucket.
    pub fn open_before(root: impl Into<PathBuf>, bucket: Arc<dyn Bucket>) -> Result<Self> {
        let mut store = Self::open(root)?;
        store.workspace()?;
        let format = store.root.join("format.json");
        let aside = store.workspace()?.fresh();
        let mut begun = bucket.fetch("format.json", &aside)?;
        if !begun && let Some((key, _)) = bucket.list("", 1)?.first() {
            // Another machine may have begun it in this moment.
            begun = bucket.fetch("format.json", &aside)?;
            if !begun {
                let message = format!(
                    "not a calib store (no format.json, but `{key}`); --store takes a store, or a prefix without anything"
                );
                return Err(Error::spec(bucket.name(), message));
            }
        }
        if begun {
            let bytes = fs::read(&aside).map_err(|e| refused(&aside, "read", &e))?;
            super::check_format(Path::new(&format!("{}/format.json", bucket.name())), &bytes)?;
            place(&aside, &format)?;
        }
        store.remote = Some(Remote {
            bucket,
            begun: AtomicBool::new(begun),
        });
        store.refresh_runs()?;
        store.refresh_tags()?;
        Ok(store)
    }

    /// Says how to come by a calib that opens `s3://BUCKET/PREFIX`.
    #[cfg(not(feature = "s3"))]
    pub fn open_s3(
        url: &str,
        _settings: &std::collections::BTreeMap<String, String>,
        _cache: &Path,
    ) -> Result<Self> {
        let message = "this calib was built without object storage: build it with `cargo install --path . --features s3`, or name a folder";
        Err(Error::spec(url, message))
    }

    /// The store as a person names it.
    pub fn name(&self) -> String {
        self.remote.as_ref().map_or_else(
            || self.root().display().to_string(),
            |remote| remote.bucket.name().to_string(),
        )
    }

    pub(super) fn in_bucket(&self) -> bool {
        self.remote.is_some()
    }

    /// The remote and the key of a file of this store; none of what is for people, or where there is no bucket.
    fn keyed(&self, path: &Path) -> Option<(&Remote, String)> {
        let remote = self.remote.as_ref()?;
        let inside = path.strip_prefix(self.root()).ok()?;
        let parts: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
        SHARED
            .contains(&parts.first()?.as_ref())
            .then(|| (remote, parts.join("/")))
    }

    /// The same where something is going to be written: the bucket becomes a store.
    fn written(&self, path: &Path) -> Result<Option<(&Remote, String)>> {
        let Some((remote, key)) = self.keyed(path) else {
            return Ok(None);
        };
        if !remote.begun.load(Ordering::Acquire) {
            let (aside, _) = self.workspace()?.write(&super::format_text()?)?;
            remote.bucket.create(&aside, "format.json")?;
            // A server that does not know the condition writes again, and the second of two would undo the first.
            if remote.bucket.create(&aside, "format.json")? {
                let message = "this server does not know put-if-absent (If-None-Match: *): take one that does, or a folder";
                return Err(Error::spec(remote.bucket.name(), message));
            }
            let _ = fs::remove_file(&aside);
            remote.begun.store(true, Ordering::Release);
        }
        Ok(Some((remote, key)))
    }

    /// Sends the file `from` as what is going to be at `path`; nothing for a store that is only a folder.
    pub(super) fn give(&self, from: &Path, path: &Path) -> Result<()> {
        self.written(path)?
            .map_or(Ok(()), |(remote, key)| remote.bucket.send(from, &key))
    }

    /// Puts a file that is aside in its place if none stands, which the bucket decides where there is one; false where one stands.
    pub(super) fn commit(&self, aside: &Path, path: &Path) -> Result<bool> {
        let Some((remote, key)) = self.written(path)? else {
            return put_if_absent(aside, path);
        };
        for _ in 0..TRIES {
            if remote.bucket.create(aside, &key)? {
                place(aside, path)?;
                return Ok(true);
            }
            if self.refresh(path)? {
                return Ok(false);
            }
            thread::sleep(PAUSE);
        }
        Err(Error::store(
            format!("{}/{key}", remote.bucket.name()),
            "exists but cannot be read: run again, finished stages are kept",
        ))
    }

    /// Takes a file of the bucket away.
    pub(super) fn withdraw(&self, path: &Path) -> Result<()> {
        self.keyed(path)
            .map_or(Ok(()), |(remote, key)| remote.bucket.remove(&key))
    }

    /// Makes a file what it is in the bucket; false where it is not there. A file of a store that is only a folder stays as it is.
    pub(super) fn refresh(&self, path: &Path) -> Result<bool> {
        let Some((remote, key)) = self.keyed(path) else {
            return Ok(true);
        };
        let aside = self.workspace()?.fresh();
        let there = remote.bucket.fetch(&key, &aside)?;
        if there {
            place(&aside, path)?;
        }
        Ok(there)
    }

    /// Fetches the file of a table; false where the bucket does not hold it whole, or where there is no bucket.
    pub(super) fn obtain(&self, table: &TableRef, path: &Path) -> Result<bool> {
        let Some((remote, key)) = self.keyed(path) else {
            return Ok(false);
        };
        let aside = self.workspace()?.fresh();
        let whole = remote.bucket.fetch(&key, &aside)? && same_bytes(&aside, table);
        if whole {
            make_read_only(&aside)?;
            place(&aside, path)?;
        } else {
            let _ = fs::remove_file(&aside);
        }
        Ok(whole)
    }

    /// A file as a person finds it: in the bucket, where there is one.
    pub(super) fn label(&self, path: &Path) -> String {
        let inside = path.strip_prefix(self.root()).unwrap_or(path);
        format!("{}/{}", self.name(), inside.display())
    }

    /// Fetches all files below a folder of the bucket that are not here; nothing for a store that is only a folder.
    pub(super) fn refresh_all(&self, folder: &str) -> Result<()> {
        let Some(remote) = &self.remote else {
            return Ok(());
        };
        let paths = remote
            .bucket
            .list(folder, ALL)?
            .into_iter()
            .filter_map(|(key, _)| below(self.root(), &key));
        let missing: Vec<PathBuf> = paths.filter(|path| !path.exists()).collect();
        together(&missing, |path| self.refresh(path).map(drop))
    }

    /// Makes the runs of the folder those of the bucket. Events only grow; a manifest that is rewritten has another length.
    fn refresh_runs(&self) -> Result<()> {
        let Some(remote) = &self.remote else {
            return Ok(());
        };
        // Before the bucket is listed: a run that begins in this moment is in the bucket first.
        let here = self.run_folders()?;
        let runs = self.root().join("runs");
        let mut there = BTreeSet::new();
        let mut stale = Vec::new();
        for (key, bytes) in remote.bucket.list("runs/", ALL)? {
            let Some(path) = below(self.root(), &key) else {
                continue;
            };
            there.extend(key.split('/').nth(1).map(String::from));
            let found = fs::metadata(&path).map(|metadata| metadata.len());
            let fresh = match found {
                Ok(length) if key.ends_with("events.jsonl") => length >= bytes,
                Ok(length) => length == bytes,
                Err(_) => false,
            };
            if !fresh {
                stale.push(path);
            }
        }
        together(&stale, |path| self.refresh(path).map(drop))?;
        for run in here
            .iter()
            .filter(|run| !there.contains(*run) && runs.join(run).join("manifest.json").exists())
        {
            let gone = runs.join(run);
            fs::remove_dir_all(&gone).map_err(|e| refused(&gone, "remove", &e))?;
        }
        Ok(())
    }

    fn refresh_tags(&self) -> Result<()> {
        let Some(remote) = &self.remote else {
            return Ok(());
        };
        let here = super::verify::files(&self.root().join("tags"))?;
        let listed = remote.bucket.list("tags/", ALL)?;
        let there: Vec<PathBuf> = listed
            .iter()
            .filter_map(|(key, _)| below(self.root(), key))
            .collect();
        together(&there, |path| self.refresh(path).map(drop))?;
        here.iter()
            .filter(|path| !there.contains(path))
            .try_for_each(|gone| remove(gone))
    }

    /// Everything in the bucket in a new folder; none for a store that is only a folder.
    pub(super) fn copy(&self) -> Result<Option<PathBuf>> {
        let Some(remote) = &self.remote else {
            return Ok(None);
        };
        let folder = self.workspace()?.fresh();
        let listed = remote.bucket.list("", ALL)?;
        if listed.is_empty() {
            return Err(Error::spec(
                remote.bucket.name(),
                "no store here; name one with --store",
            ));
        }
        let foreign = |key: &str| {
            Error::spec(
                format!("{}/{key}", remote.bucket.name()),
                "is nothing that calib wrote: move it away",
            )
        };
        let files = listed.iter().map(|(key, _)| {
            below(&folder, key)
                .map(|path| (key, path))
                .ok_or_else(|| foreign(key))
        });
        together(&files.collect::<Result<Vec<_>>>()?, |(key, path)| {
            make_dir(path.parent().unwrap_or(&folder))?;
            remote.bucket.fetch(key, path).map(drop)
        })?;
        Ok(Some(folder))
    }
}

/// The path of a key below a folder; none where a part of it cannot be a file name.
fn below(folder: &Path, key: &str) -> Option<PathBuf> {
    key.split('/').try_fold(folder.to_path_buf(), |path, part| {
        Some(path.join(component(part).ok()?))
    })
}
