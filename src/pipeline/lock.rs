//! One advisory lock per action, so that two runs share work instead of doing it twice. Correctness does not depend on it.

use crate::store::{ActionId, Store};
use std::fs::{self, File};
use std::path::PathBuf;
use std::time::Duration;

/// How long a run waits for another that does the same; after that it does the work itself.
const PATIENCE: Duration = Duration::from_secs(600);
const PAUSE: Duration = Duration::from_millis(50);

/// Held while a stage runs; the kernel frees it when the process dies.
pub(super) struct ActionLock {
    held: Option<(File, PathBuf)>,
}

impl ActionLock {
    /// Takes the lock of an action, waiting for whoever has it; `waiting` is told once.
    pub fn take(store: &Store, action: &ActionId, waiting: &mut dyn FnMut()) -> Self {
        let folder = store.root().join("locks");
        let path = folder.join(format!("{action}.lock"));
        let open = || {
            fs::create_dir_all(&folder)
                .and_then(|()| File::options().create(true).append(true).open(&path))
        };
        // Where locks cannot be had the work may be done twice, which is harmless.
        let Ok(file) = open() else {
            return Self { held: None };
        };
        let mut waited = Duration::ZERO;
        loop {
            match file.try_lock() {
                Ok(()) => {
                    return Self {
                        held: Some((file, path)),
                    };
                }
                Err(fs::TryLockError::WouldBlock) if waited < PATIENCE => {
                    if waited.is_zero() {
                        waiting();
                    }
                    std::thread::sleep(PAUSE);
                    waited += PAUSE;
                }
                Err(_) => return Self { held: None },
            }
        }
    }
}

impl Drop for ActionLock {
    fn drop(&mut self) {
        if let Some((file, path)) = self.held.take() {
            let _ = fs::remove_file(path);
            let _ = file.unlock();
        }
    }
}
