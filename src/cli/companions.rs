//! The other files of a controller's program: those that lie where its controller keeps them, and those that a person names.

use super::readable;
use crate::error::Result;
use crate::program::{Companion, Language};
use crate::raw;
use std::path::{Path, PathBuf};

/// What KUKA's controllers keep the frames, tools and loads of a robot in.
const CONFIGURATION: &str = "$config.dat";

/// Folders above the program in which there may be one with the system's files.
const ABOVE: usize = 4;

/// Files with their bytes.
pub(super) struct Companions(Vec<(String, Vec<u8>)>);

impl Companions {
    /// The files beside a program: those of its name with other endings of its language, the system's data, and those that are named.
    pub(crate) fn of(program: &Path, language: Language, named: &[PathBuf]) -> Result<Self> {
        let mut paths = if language == Language::Krl {
            found(program)
        } else {
            Vec::new()
        };
        let others = named.iter().filter(|path| !paths.contains(path)).cloned();
        paths.extend(others.collect::<Vec<_>>());
        let read = |path: PathBuf| {
            let bytes = readable(&path, raw::bytes(&path))?;
            Ok((path.display().to_string(), bytes))
        };
        paths.into_iter().map(read).collect::<Result<_>>().map(Self)
    }

    pub(crate) fn files(&self) -> Vec<Companion<'_>> {
        self.0
            .iter()
            .map(|(place, text)| Companion { place, text })
            .collect()
    }

    /// What was read beside the program, in a line; none where nothing was.
    pub(crate) fn summary_line(&self) -> Option<String> {
        let names: Vec<&str> = self.0.iter().map(|(place, _)| place.as_str()).collect();
        (!names.is_empty()).then(|| format!("read with the program: {}\n", names.join(", ")))
    }
}

/// The data list of a program of KUKA's: the file of its name that ends in `dat`; none of a data list itself.
pub(super) fn data_list(program: &Path) -> Option<PathBuf> {
    let is_list = |path: &Path| raw::ending(path) == "dat";
    let mut beside = found(program).into_iter();
    let its_name = stem(program);
    let list = beside.find(|path| is_list(path) && stem(path) == its_name);
    list.filter(|_| !is_list(program))
}

/// Files of the same name, then the system's data.
fn found(program: &Path) -> Vec<PathBuf> {
    let folder = program
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let name = |path: &Path| {
        path.file_name()
            .map(|name| name.to_string_lossy().to_lowercase())
            .unwrap_or_default()
    };
    let (its_name, stem) = (name(program), stem(program));
    let is_other = |path: &PathBuf| {
        let known = Language::of_ending(&raw::ending(path)) == Some(Language::Krl);
        known && self::stem(path) == stem && name(path) != its_name
    };
    let mut out: Vec<PathBuf> = files(folder).into_iter().filter(is_other).collect();
    let whole = folder
        .canonicalize()
        .unwrap_or_else(|_| folder.to_path_buf());
    let system = whole.ancestors().take(ABOVE).flat_map(|above| {
        files(above)
            .into_iter()
            .filter(move |path| path.is_dir() && name(path) == "system")
            .collect::<Vec<_>>()
    });
    let configuration = std::iter::once(folder.to_path_buf()).chain(system);
    let configuration = configuration
        .flat_map(|folder| files(&folder))
        .find(|path| name(path) == CONFIGURATION);
    out.extend(configuration.filter(|path| name(path) != its_name));
    out
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// What a folder holds, in the order of its names; nothing where it cannot be read.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    // A path that was given without a folder stays one.
    let path = |entry: std::fs::DirEntry| {
        if folder == Path::new(".") {
            entry.file_name().into()
        } else {
            entry.path()
        }
    };
    let mut all: Vec<PathBuf> = entries.map(path).collect();
    all.sort();
    all
}
