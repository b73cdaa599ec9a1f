//! The folder of one process below `tmp/`, locked while the process lives, swept by others when it is dead.

use std::fs::{self, File, TryLockError};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::disk::{make_dir, refused};
use crate::error::Result;

/// `tmp/<name>/` with its lock `tmp/<name>.lock`; the kernel frees the lock when the process dies. No name is ever used
/// twice: a sweeper that still holds a dead folder's lock would otherwise remove the living folder of the same name.
#[derive(Debug)]
pub(super) struct Workspace {
    dir: PathBuf,
    lock_path: PathBuf,
    _lock: File,
    next: AtomicU64,
}

impl Workspace {
    /// Sweeps what dead processes left, then opens a folder of its own.
    pub(super) fn open(tmp: &Path) -> Result<Self> {
        make_dir(tmp)?;
        sweep(tmp);
        loop {
            let dir = tmp.join(fresh_name());
            let lock_path = dir.with_extension("lock");
            let lock =
                File::create_new(&lock_path).map_err(|e| refused(&lock_path, "write", &e))?;
            // A sweeper may have come between creating and locking; then the name is gone or held: take another.
            if lock.try_lock().is_err() || !lock_path.exists() {
                continue;
            }
            make_dir(&dir)?;
            return Ok(Self {
                dir,
                lock_path,
                _lock: lock,
                next: AtomicU64::new(0),
            });
        }
    }

    /// A path that nobody else uses.
    pub(super) fn fresh(&self) -> PathBuf {
        self.dir
            .join(self.next.fetch_add(1, Ordering::Relaxed).to_string())
    }
}

/// A name that nobody else has: 128 random bits, by the kernel's randomness in the keys of std's hasher. No result depends on it.
fn fresh_name() -> String {
    let draw = || RandomState::new().build_hasher().finish();
    format!("{:016x}{:016x}", draw(), draw())
}

impl Drop for Workspace {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.dir);
        let _ = fs::remove_file(&self.lock_path);
    }
}

/// True while a living process has a folder below `tmp`.
pub(super) fn in_use(tmp: &Path) -> bool {
    let entries = fs::read_dir(tmp)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path());
    let mut locks = entries.filter(|path| {
        path.extension()
            .is_some_and(|extension| extension == "lock")
    });
    locks.any(|path| {
        File::open(path).is_ok_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
    })
}

/// Removes the folders whose owner is dead, that is, whose lock can be had. What cannot be removed stays: it harms nobody.
fn sweep(tmp: &Path) {
    let Ok(entries) = fs::read_dir(tmp) else {
        return;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.extension().is_none_or(|extension| extension != "lock") {
            continue;
        }
        let Ok(lock) = File::open(&path) else {
            continue;
        };
        match lock.try_lock() {
            Ok(()) => {
                let _ = fs::remove_dir_all(path.with_extension(""));
                let _ = fs::remove_file(&path);
            }
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => (),
        }
    }
}
