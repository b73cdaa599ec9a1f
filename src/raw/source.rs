//! Where the bytes of an input lie: in a regular file, or in a folder with the parts of a split bag, read one behind the other.

use super::{ending, open};
use std::fs::File;
use std::io::{self, Cursor, Error, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// What the parts of a bag end in.
const PARTS: [&str; 2] = ["mcap", "db3"];

/// Bytes that can be read at any place.
pub trait InputSource: Read + Seek + Send {
    /// Where each part begins, then where the last one ends. Leaves the place at the beginning.
    fn bounds(&mut self) -> io::Result<Vec<u64>> {
        let end = self.seek(SeekFrom::End(0))?;
        self.rewind()?;
        Ok(vec![0, end])
    }
}

impl InputSource for File {}
impl InputSource for Cursor<Vec<u8>> {}

/// Opens a regular file, or a folder that holds the parts of a bag.
pub fn source(path: &Path) -> io::Result<Box<dyn InputSource>> {
    if !path.is_dir() {
        return Ok(Box::new(open(path)?));
    }
    let mut parts: Vec<PathBuf> = Vec::new();
    for entry in path.read_dir()? {
        let part = entry?.path();
        if PARTS.contains(&ending(&part).as_str()) && part.is_file() {
            parts.push(part);
        }
    }
    // run_2 comes before run_10.
    let number = |path: &PathBuf| {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        (
            name[..name.len() - digits].to_string(),
            name[name.len() - digits..].parse::<u64>().ok(),
        )
    };
    parts.sort_by_cached_key(|part| (number(part), part.clone()));
    let of = |kind: &str| parts.iter().any(|part| ending(part) == kind);
    if !PARTS.iter().any(|kind| of(kind)) || PARTS.iter().all(|kind| of(kind)) {
        let message = "is a folder; allowed: a file, or a folder with the parts of one bag, all .mcap or all .db3";
        return Err(Error::new(ErrorKind::InvalidInput, message));
    }
    let mut all = JoinedParts {
        files: Vec::new(),
        bounds: vec![0],
        at: 0,
    };
    for part in parts {
        let file = open(&part)?;
        all.bounds
            .push(all.bounds[all.files.len()] + file.metadata()?.len());
        all.files.push(file);
    }
    Ok(Box::new(all))
}

/// Files one behind the other.
struct JoinedParts {
    files: Vec<File>,
    bounds: Vec<u64>,
    at: u64,
}

impl Read for JoinedParts {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let part = self.bounds.partition_point(|bound| *bound <= self.at);
        let (Some(end), Some(file)) = (
            self.bounds.get(part),
            self.files.get_mut(part.wrapping_sub(1)),
        ) else {
            return Ok(0);
        };
        let most = usize::try_from(end - self.at)
            .unwrap_or(usize::MAX)
            .min(buffer.len());
        file.seek(SeekFrom::Start(self.at - self.bounds[part - 1]))?;
        let read = file.read(&mut buffer[..most])?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for JoinedParts {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let end = self.bounds.last().copied().unwrap_or_default();
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => end.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| Error::new(ErrorKind::InvalidInput, "before the first byte"))?;
        Ok(self.at)
    }
}

impl InputSource for JoinedParts {
    fn bounds(&mut self) -> io::Result<Vec<u64>> {
        self.at = 0;
        Ok(self.bounds.clone())
    }
}
