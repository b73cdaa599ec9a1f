//! A data set of LeRobot (versions 2 and 3): a folder whose `meta/info.json` says how its Parquet files are named, at which rate they were
//! recorded, and what the numbers of their lists are called.

use crate::error::{Error, Result};
use crate::raw;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Lists of commands and of measured angles.
pub(super) const COMMAND: &str = "action";
pub(super) const ANGLE: &str = "observation.state";
/// What tells episodes apart.
pub(super) const EPISODE: &str = "episode_index";

/// A data set.
pub(super) struct DataSet {
    folder: PathBuf,
    /// Rows a second, as stated.
    pub(super) fps: f64,
    /// What the numbers of the lists are called; nothing where it is not said.
    pub(super) names: Vec<String>,
    /// Files of rows by a pattern below the folder, `data/chunk-*/file-*.parquet`.
    pattern: String,
    /// The first file of rows.
    pub(super) first: PathBuf,
}

#[derive(Deserialize)]
struct Info {
    fps: f64,
    data_path: String,
    features: BTreeMap<String, Feature>,
}

#[derive(Deserialize)]
struct Feature {
    #[serde(default)]
    shape: Vec<usize>,
    #[serde(default)]
    names: Value,
}

impl Feature {
    /// Names as a list, or as a list under one heading (`motors`).
    fn names(&self) -> Vec<String> {
        let list = match &self.names {
            Value::Object(headed) if headed.len() == 1 => headed.values().next(),
            other => Some(other),
        };
        let names = list.and_then(Value::as_array).into_iter().flatten();
        names
            .filter_map(|name| name.as_str().map(String::from))
            .collect()
    }
}

/// A joint's name in a data set without what recorders add to it.
fn plain(name: &str) -> &str {
    let name = name.strip_suffix(".pos").unwrap_or(name);
    name.strip_prefix("main_").unwrap_or(name)
}

impl DataSet {
    /// The data set in a folder; `None` where it is none. Fails where it says what cannot be read.
    pub(super) fn open(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join("meta").join("info.json");
        if !path.is_file() {
            return Ok(None);
        }
        let label = path.display().to_string();
        let text = raw::text(&path).map_err(|error| Error::unreadable(&label, &error))?;
        let info: Info = serde_json::from_str(&text).map_err(|error| {
            let expected =
                "expected `fps`, `data_path` and `features` as LeRobot 2 and 3 write them";
            Error::data(
                format!("{label}:{}", error.line()),
                format!("{error}; {expected}"),
            )
        })?;
        let length = |name: &str| {
            let feature = info.features.get(name);
            feature.and_then(|feature| feature.shape.first().copied())
        };
        let (commands, angles) = (length(COMMAND), length(ANGLE));
        if commands.is_none() || commands != angles {
            let known: Vec<&str> = info.features.keys().map(String::as_str).collect();
            let message = format!(
                "features {} are no lists `{COMMAND}` and `{ANGLE}` of one length: without commands and angles of the same joints nothing is compared",
                known.join(", ")
            );
            return Err(Error::data(&label, message));
        }
        if !(info.fps > 0.0 && info.fps.is_finite()) {
            return Err(Error::data(&label, "fps: allowed: above 0"));
        }
        let pattern = starred(&info.data_path);
        let first = first_match(folder, &pattern).ok_or_else(|| {
            let message = format!("no file matches `{pattern}`, which is its `data_path`");
            Error::data(&label, message)
        })?;
        Ok(Some(Self {
            folder: folder.to_path_buf(),
            fps: info.fps,
            names: info.features[ANGLE].names(),
            pattern,
            first,
        }))
    }

    /// The pattern of all files of rows, as a path.
    pub(super) fn files(&self) -> PathBuf {
        let folder = self.folder.canonicalize();
        folder
            .unwrap_or_else(|_| self.folder.clone())
            .join(&self.pattern)
    }

    /// Whether angles are per cent of the range: `most` is the largest of them. Recorders clamp those to 100 and call them `NAME.pos`, as they
    /// may call degrees.
    pub(super) fn may_be_per_cent(&self, most: f64) -> bool {
        most <= 100.0 && self.names.iter().any(|name| name.ends_with(".pos"))
    }

    /// Fails where a joint of the robot file is another number of the lists than its own.
    pub(super) fn must_be_in_order(&self, joints: &[String]) -> Result<()> {
        let at = |joint: &String| self.names.iter().position(|name| plain(name) == joint);
        let other = joints.iter().enumerate();
        let mut other = other.filter_map(|(k, joint)| Some((k, at(joint)?, joint)));
        match other.find(|(k, at, _)| k != at) {
            None => Ok(()),
            Some((k, at, joint)) => {
                let message = format!(
                    "`{joint}`, joint {} of the robot file, is number {} of `{ANGLE}` ({}); lists are read from their first number on, in the order of the robot file's joints",
                    k + 1,
                    at + 1,
                    self.names.join(", ")
                );
                Err(Error::data(self.folder.display().to_string(), message))
            }
        }
    }
}

/// A path with a star for everything in braces.
fn starred(path: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for letter in path.chars() {
        match letter {
            '{' => {
                inside = true;
                out.push('*');
            }
            '}' => inside = false,
            letter if !inside => out.push(letter),
            _ => (),
        }
    }
    out
}

/// The first file below a folder, by name, that a pattern of stars means.
fn first_match(folder: &Path, pattern: &str) -> Option<PathBuf> {
    let whole = Path::new(&glob::Pattern::escape(&folder.to_string_lossy())).join(pattern);
    let mut found: Vec<PathBuf> = glob::glob(&whole.to_string_lossy())
        .ok()?
        .flatten()
        .collect();
    found.retain(|path| path.is_file());
    found.sort();
    found.into_iter().next()
}
