//! Files that survive a crash: write aside, move into place, and make durable: at once, or later with others. And what
//! to do when the disk refuses.
//!
//! Group commit: what is moved into place can be seen at once and is owed to the disk; `sync` pays everything, many at a time.
//!
//! The folder of one process below `tmp/`, locked while the process lives, swept by others when it is dead.

use super::Store;
use crate::error::{Error, Fault, Result};
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

/// What went wrong with a path of the store, and what the reader can do about it.
pub(super) fn refused(path: &Path, doing: &str, error: &io::Error) -> Error {
    let remedy = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "free some space there, or choose another place with --store DIR, and run again: finished stages are kept"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "make the folder writable or choose another with --store DIR"
        }
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists | ErrorKind::IsADirectory => {
            "something else is in the way: remove it, or choose another place with --store DIR"
        }
        _ => "check the disk and run again: finished stages are kept",
    };
    Error::store(
        path.display().to_string(),
        format!("cannot {doing}: {error}; {remedy}"),
    )
}

/// Makes a folder and those above it.
pub(super) fn make_dir(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|e| refused(path, "make the folder", &e))
}

/// Makes the entries of a folder durable.
pub(super) fn sync_dir(path: &Path) -> Result<()> {
    File::open(path)
        .and_then(|dir| dir.sync_all())
        .map_err(|e| refused(path, "sync the folder", &e))
}

/// What is in a folder; nothing where it is not there.
pub(super) fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    match fs::read_dir(folder) {
        Ok(entries) => Ok(entries.flatten().map(|entry| entry.path()).collect()),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(e) => Err(refused(folder, "read", &e)),
    }
}

/// The bytes of a file; none where it is not there.
pub(super) fn read(path: &Path) -> Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(refused(path, "read", &e)),
    }
}

/// Takes a file away; nothing where it is not there.
pub(super) fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(refused(path, "remove", &e)),
        _ => Ok(()),
    }
}

/// Moves `from` to `to`, over what may be there, atomically.
pub(super) fn place(from: &Path, to: &Path) -> Result<()> {
    make_dir(to.parent().unwrap_or(Path::new(".")))?;
    fs::rename(from, to).map_err(|e| refused(to, "put the file in place", &e))?;
    // Renaming one name of a file over another name of the same file does nothing, by POSIX.
    let _ = fs::remove_file(from);
    Ok(())
}

/// Gives the finished file `from` the name `to` if that name is free; false if it is taken.
pub(super) fn put_if_absent(from: &Path, to: &Path) -> Result<bool> {
    make_dir(to.parent().unwrap_or(Path::new(".")))?;
    match fs::hard_link(from, to) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
        // File systems without hard links: a crash may leave a torn file, which readers treat as absent.
        Err(_) => match copy_new(from, to) {
            Ok(()) => Ok(true),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(e) => Err(refused(to, "write", &e)),
        },
    }
}

fn copy_new(from: &Path, to: &Path) -> io::Result<()> {
    let bytes = fs::read(from)?;
    let mut file = File::create_new(to)?;
    file.write_all(&bytes)?;
    file.sync_all()
}

/// Takes the right to write away from an immutable file, so that no tool edits it in place through another name.
pub(super) fn make_read_only(path: &Path) -> Result<()> {
    let freeze = || {
        let mut permissions = fs::metadata(path)?.permissions();
        permissions.set_readonly(true);
        fs::set_permissions(path, permissions)
    };
    freeze().map_err(|e| refused(path, "make read-only", &e))
}

/// A name from outside as one component of a path: no separators, no leading dot.
pub(super) fn component(name: &str) -> Result<&str> {
    let allowed = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ');
    if name.is_empty()
        || name.len() > 120
        || name.starts_with(['.', ' '])
        || !name.chars().all(allowed)
    {
        let shown = name.chars().take(40).collect::<String>();
        let message = "cannot be part of a file name; allowed: letters, digits, `_`, `-`, `.` and blanks, up to 120 bytes, not starting with a dot or blank";
        return Err(Error::spec(format!("name {shown:?}"), message));
    }
    Ok(name)
}

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
    /// Writes a file over what may be there, in the bucket first; durable after the next `sync`.
    pub(super) fn put(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let (aside, file) = self.workspace()?.write(bytes)?;
        self.give(&aside, path)?;
        place(&aside, path)?;
        self.owe(path, file)
    }

    /// The same, durable before it is seen, so that a power cut leaves the one or the other.
    pub(super) fn put_now(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let aside = self.workspace()?.write_synced(bytes)?;
        self.give(&aside, path)?;
        place(&aside, path)?;
        sync_dir(path.parent().unwrap_or(Path::new(".")))
    }

    /// Writes a file where none is, which the bucket decides where there is one, durable after the next `sync`; false where one stands.
    pub(super) fn put_once(&self, path: &Path, bytes: &[u8]) -> Result<bool> {
        let (aside, file) = self.workspace()?.write(bytes)?;
        let is_first = self.commit(&aside, path)?;
        let _ = fs::remove_file(&aside);
        if is_first {
            self.owe(path, file)?;
        }
        Ok(is_first)
    }

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
    let work = || {
        let mut failed = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else {
                return failed;
            };
            failed.extend(one(item).err().map(|error| (at, error)));
        }
    };
    let failed = thread::scope(|scope| {
        // Where there are no more threads, those that are there do it.
        let threads: Vec<_> = (1..items.len().min(AT_ONCE))
            .map_while(|_| thread::Builder::new().spawn_scoped(scope, work).ok())
            .collect();
        let joined = |thread: thread::ScopedJoinHandle<_>| {
            (thread.join()).unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        let mut failed = work();
        failed.extend(threads.into_iter().flat_map(joined));
        failed
    });
    let first = failed.into_iter().min_by_key(|(at, _)| *at);
    first.map_or(Ok(()), |(_, error)| Err(error))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

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

    /// Writes a file that nobody sees yet; the handle is for making it durable.
    pub(super) fn write(&self, bytes: &[u8]) -> Result<(PathBuf, File)> {
        let aside = self.fresh();
        let write = || {
            let mut file = File::create(&aside)?;
            file.write_all(bytes)?;
            Ok(file)
        };
        let file = write().map_err(|e| refused(&aside, "write", &e))?;
        Ok((aside, file))
    }

    /// The same with its bytes (not yet its name) durable.
    pub(super) fn write_synced(&self, bytes: &[u8]) -> Result<PathBuf> {
        let (aside, file) = self.write(bytes)?;
        file.sync_all().map_err(|e| refused(&aside, "write", &e))?;
        Ok(aside)
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

/// The locks of the folders below `tmp`.
fn locks(tmp: &Path) -> impl Iterator<Item = (PathBuf, File)> {
    let entries = fs::read_dir(tmp).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.path())
        .filter(|path| ends_in(path, "lock"))
        .filter_map(|path| File::open(&path).ok().map(|lock| (path, lock)))
}

/// True while a living process has a folder below `tmp`.
pub(super) fn in_use(tmp: &Path) -> bool {
    locks(tmp).any(|(_, lock)| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Removes the folders whose owner is dead, that is, whose lock can be had. What cannot be removed stays: it harms nobody.
fn sweep(tmp: &Path) {
    for (path, _lock) in locks(tmp).filter(|(_, lock)| lock.try_lock().is_ok()) {
        let _ = fs::remove_dir_all(path.with_extension(""));
        let _ = fs::remove_file(&path);
    }
}

/// Whether a file's name has this extension.
pub(super) fn ends_in(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|end| end == extension)
}

/// A file that one living process has locked, and that is removed with it; the kernel frees the lock when the process dies. Two that do the same
/// share the work by it, and no result depends on it.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    /// None where locks cannot be had: then both do the work, and who is first stands.
    _file: Option<File>,
}

impl Claim {
    /// None while another living process has it.
    pub fn take(path: &Path) -> Option<Self> {
        let open = || {
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            File::options().create(true).append(true).open(path)
        };
        let file = match open().map(|file| (file.try_lock(), file)) {
            Ok((Err(TryLockError::WouldBlock), _)) => return None,
            Ok((Ok(()), mut file)) => {
                // For runs that wait; one that cannot be written is not named.
                let cleared = file.set_len(0);
                let _ = cleared.and_then(|()| write!(file, "{}", std::process::id()));
                Some(file)
            }
            Ok((Err(TryLockError::Error(_)), _)) | Err(_) => None,
        };
        Some(Self {
            path: path.into(),
            _file: file,
        })
    }

    /// The process that has it; none where that is not known.
    pub fn holder(path: &Path) -> Option<u32> {
        fs::read_to_string(path).ok()?.parse().ok()
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_waits_for_a_claim_reads_which_process_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("locks/stage.lock");
        assert_eq!(Claim::holder(&path), None);
        // Of a process that was killed.
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, "4194305").unwrap();
        let claim = Claim::take(&path).unwrap();
        assert!(Claim::take(&path).is_none());
        assert_eq!(Claim::holder(&path), Some(std::process::id()));
        drop(claim);
        assert!(!path.exists() && Claim::take(&path).is_some());
    }

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
