//! Group commit: what is moved into place can be seen at once and is owed to the disk; `sync` pays everything, many at a time.
//!
//! One after another, syncs cost a round trip to the disk each; together they cost about one. A crash of the process loses nothing;
//! a power cut may tear what was still owed, which its hash or seal shows: as good as absent.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use super::Store;
use super::disk::{refused, sync_dir};
use crate::error::{Error, Fault, Result};

/// Syncs in flight; more give a disk nothing more to put together.
const AT_ONCE: usize = 16;
/// Files that wait at most, each an open handle.
const WAITING: usize = 200;

#[derive(Debug, Default)]
pub(super) struct Durability {
    owed: Mutex<Owed>,
    /// Held while syncing: who comes second finds its files synced by the first.
    paying: Mutex<()>,
}

#[derive(Debug, Default)]
struct Owed {
    files: Vec<(PathBuf, File)>,
    folders: BTreeSet<PathBuf>,
    /// What could not be synced once can never be said to be durable.
    refused: Option<Fault>,
}

impl Store {
    /// Owes a file that was moved to `path`, and its name there.
    pub(super) fn owe(&self, path: &Path, file: File) -> Result<()> {
        let full = {
            let mut owed = lock(&self.durability.owed);
            owed.folders.extend(path.parent().map(Path::to_path_buf));
            owed.files.push((path.into(), file));
            owed.files.len() >= WAITING
        };
        if full { self.sync() } else { Ok(()) }
    }

    /// Owes the names in a folder.
    pub(super) fn owe_folder(&self, folder: &Path) {
        lock(&self.durability.owed).folders.insert(folder.into());
    }

    /// Makes everything durable that was written so far.
    pub fn sync(&self) -> Result<()> {
        self.sync_then(|| Ok(None))
    }

    /// Makes all files durable, then moves into place what only then may be seen (handing back where it is), then makes all names durable.
    pub(super) fn sync_then(&self, place: impl FnOnce() -> Result<Option<PathBuf>>) -> Result<()> {
        let _alone = lock(&self.durability.paying);
        let files = std::mem::take(&mut lock(&self.durability.owed).files);
        let synced = together(&files, |(path, file)| {
            file.sync_all()
                .map_err(|e| refused(path, "make durable", &e))
        });
        let result = synced.and_then(|()| {
            let placed = place()?;
            let mut owed = lock(&self.durability.owed);
            let mut folders = std::mem::take(&mut owed.folders);
            drop(owed);
            folders.extend(placed.and_then(|path| path.parent().map(Path::to_path_buf)));
            together(&folders.into_iter().collect::<Vec<_>>(), |folder| {
                sync_dir(folder)
            })
        });
        let mut owed = lock(&self.durability.owed);
        if let Err(Error::Store(fault)) = &result {
            owed.refused.get_or_insert_with(|| fault.clone());
        }
        match &owed.refused {
            Some(fault) if result.is_ok() => Err(Error::Store(fault.clone())),
            _ => result,
        }
    }
}

/// Does the same to all, several at a time; hands back the first failure by position.
pub(super) fn together<T: Sync>(items: &[T], one: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    let next = AtomicUsize::new(0);
    let failure: Mutex<Option<(usize, Error)>> = Mutex::new(None);
    let work = || {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { break };
            if let Err(error) = one(item) {
                let mut failure = lock(&failure);
                if failure.as_ref().is_none_or(|(before, _)| at < *before) {
                    *failure = Some((at, error));
                }
            }
        }
    };
    thread::scope(|scope| {
        for _ in 1..items.len().min(AT_ONCE) {
            // Where there are no more threads, those that are there do it.
            if thread::Builder::new().spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        work();
    });
    failure
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
        .map_or(Ok(()), |(_, error)| Err(error))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_could_not_be_made_durable_is_never_said_to_be() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path().join("store")).unwrap();
        let write = |path: &Path| {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            store.owe(path, File::create(path).unwrap()).unwrap();
        };
        let paths: Vec<PathBuf> = (0..50)
            .map(|n| store.root().join(format!("{}/{n}", n % 7)))
            .collect();
        paths.iter().for_each(|path| write(path));
        store.sync().unwrap();
        paths.iter().for_each(|path| write(path));
        std::fs::remove_dir_all(store.root().join("3")).unwrap();
        let error = store.sync().unwrap_err();
        assert!(
            error.exit_code() == 75 && error.to_string().contains("store/3"),
            "{error}"
        );
        assert_eq!(
            store.sync().unwrap_err().to_string(),
            error.to_string(),
            "also when asked again"
        );
    }
}
