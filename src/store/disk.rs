//! Files that survive a crash: write aside, move into place, and make durable: at once here, or later with others in `durable`. And what
//! to do when the disk refuses.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use crate::error::{Error, Result};

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

/// Writes a new file; the handle is for making it durable.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<File> {
    let write = || {
        let mut file = File::create(path)?;
        file.write_all(bytes)?;
        Ok(file)
    };
    write().map_err(|e| refused(path, "write", &e))
}

/// Writes a new file and makes its bytes (not yet its name) durable.
pub(super) fn write_synced(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, bytes)?
        .sync_all()
        .map_err(|e| refused(path, "write", &e))
}

/// Moves `from` to `to`, over what may be there, atomically.
pub(super) fn place(from: &Path, to: &Path) -> Result<()> {
    make_dir(to.parent().unwrap_or(Path::new(".")))?;
    fs::rename(from, to).map_err(|e| refused(to, "put the file in place", &e))?;
    // Renaming one name of a file over another name of the same file does nothing, by POSIX.
    let _ = fs::remove_file(from);
    Ok(())
}

/// Moves `from` to `to`, over what may be there, atomically and durably.
pub(super) fn replace(from: &Path, to: &Path) -> Result<()> {
    place(from, to)?;
    sync_dir(to.parent().unwrap_or(Path::new(".")))
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
