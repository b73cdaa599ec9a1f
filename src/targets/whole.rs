//! Files that appear only when they are whole.

use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// The error of an output file that could not be written.
pub fn unwritten(out: &Path, error: &std::io::Error) -> Error {
    Error::store(
        out.display().to_string(),
        format!("cannot be written: {error}"),
    )
}

/// A file appears only when it is whole; a pipe or a device is written as it stands.
pub fn whole<T>(out: &Path, fill: impl FnOnce(File) -> Result<T>) -> Result<T> {
    if out
        .metadata()
        .is_ok_and(|found| !found.is_file() && !found.is_dir())
    {
        return fill(
            File::options()
                .write(true)
                .open(out)
                .map_err(|error| unwritten(out, &error))?,
        );
    }
    let mut name = out.to_path_buf().into_os_string();
    name.push(".part");
    let aside = PathBuf::from(name);
    let file = File::create(&aside).map_err(|error| unwritten(out, &error))?;
    let result = fill(file).and_then(|filled| {
        std::fs::rename(&aside, out)
            .map(|()| filled)
            .map_err(|error| unwritten(out, &error))
    });
    if result.is_err() {
        let _ = std::fs::remove_file(&aside);
    }
    result
}
