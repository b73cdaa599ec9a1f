//! The robots of a fleet, each with its name, its groups and what it sets in the pipeline.

use super::file::{FleetFile, FleetRobot, RobotSource, faulty};
use super::sources::{read_list, read_recording};
use crate::error::{Error, Result};
use crate::pipeline::trouble_at;
use crate::stage::matches;
use crate::store::Store;
use crate::yaml::{Node, Trouble};
use std::collections::BTreeMap;
use std::path::Path;

/// All robots, in the order of the file, those of a source by name.
#[derive(Debug, Clone, Default)]
pub struct Roster(pub Vec<FleetRobot>);

/// The variable that takes a robot's folder, where the file does not say.
const FOLDER: &str = "case";

impl Roster {
    /// Finds the robots of all sources; every fault at once.
    pub(super) fn gather(
        path: &Path,
        file: &FleetFile,
        tree: &Node,
        store: &Store,
    ) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut robots: Vec<FleetRobot> = Vec::new();
        let mut troubles = Vec::new();
        for (index, source) in file.robots.iter().enumerate() {
            let place = format!("robots[{index}]");
            let mut found = match found(folder, file, source, store) {
                Ok(found) => found,
                Err(Error::Spec(faults)) => {
                    let mark = tree.nearest_mark(&place);
                    troubles.extend(faults.into_iter().map(|fault| {
                        Trouble::new(fault.message)
                            .at(mark)
                            .below(&format!("{place}.{}", fault.place))
                    }));
                    continue;
                }
                Err(other) => return Err(other),
            };
            for robot in &mut found {
                let sets = std::mem::take(&mut robot.sets);
                robot.set_values(&file.set);
                robot.set_values(&source.set);
                robot.sets.extend(sets);
                robot.groups = robot.groups.or(&source.groups).or(&file.groups);
            }
            robots.extend(found);
        }
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for robot in &robots {
            *seen.entry(&robot.name).or_default() += 1;
        }
        for (name, times) in seen.into_iter().filter(|(_, times)| *times > 1) {
            let message = format!("{times} robots have the name {name:?}; names identify robots");
            troubles.push(trouble_at(tree, "robots", message));
        }
        for (index, exception) in file.overrides.iter().enumerate() {
            for (k, pattern) in exception.robots.iter().enumerate() {
                if !robots.iter().any(|robot| matches(pattern, &robot.name)) {
                    let place = format!("overrides[{index}].robots[{k}]");
                    let message = format!("no robot has a name like {pattern:?}");
                    troubles.push(trouble_at(tree, &place, message));
                }
            }
            for robot in &mut robots {
                let mut patterns = exception.robots.iter();
                if patterns.any(|pattern| matches(pattern, &robot.name)) {
                    robot.set_values(&exception.set);
                    robot.groups = exception.groups.or(&robot.groups);
                }
            }
        }
        if troubles.is_empty() {
            Ok(Self(robots))
        } else {
            Err(faulty(&path.display().to_string(), troubles))
        }
    }

    /// The position of a robot by its name.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        self.0.iter().position(|robot| robot.name == name)
    }
}

fn found(
    folder: &Path,
    file: &FleetFile,
    source: &RobotSource,
    store: &Store,
) -> Result<Vec<FleetRobot>> {
    if let Some(pattern) = &source.folders {
        return folders(
            folder,
            pattern,
            source.variable.as_deref().unwrap_or(FOLDER),
        );
    }
    if let Some(path) = &source.list {
        return read_list(
            &folder.join(path),
            source.variable.as_deref().unwrap_or(FOLDER),
        );
    }
    match (&source.recording, &source.variable) {
        (Some(path), Some(variable)) => {
            read_recording(&folder.join(path), &source.by, variable, &file.name, store)
        }
        _ => Ok(Vec::new()),
    }
}

fn folders(folder: &Path, pattern: &str, variable: &str) -> Result<Vec<FleetRobot>> {
    let base = folder.to_str().ok_or_else(|| {
        Error::spec(
            "folders",
            "the folder of this file has a name that is not UTF-8",
        )
    })?;
    let whole = if base.is_empty() || Path::new(pattern).is_absolute() {
        pattern.to_string()
    } else {
        format!("{}/{pattern}", glob::Pattern::escape(base))
    };
    let paths = glob::glob(&whole)
        .map_err(|error| Error::spec("folders", format!("`{pattern}` is no pattern: {error}")))?;
    let mut robots = Vec::new();
    for path in paths {
        let path = path.map_err(|error| Error::spec("folders", format!("`{pattern}`: {error}")))?;
        if !path.is_dir() {
            continue;
        }
        let raw = path.file_name().unwrap_or(path.as_os_str());
        let mut robot = FleetRobot::new(raw.to_string_lossy().into_owned());
        match path.to_str() {
            Some(text) => robot.set_text(variable, text),
            None => {
                // Two such names may look alike once they are text.
                robot.name = format!(
                    "{} ({})",
                    robot.name,
                    &blake3::hash(raw.as_encoded_bytes()).to_hex()[..8]
                );
                robot.unreadable = Some("the folder's name is not UTF-8: rename it".into());
            }
        }
        robots.push(robot);
    }
    if robots.is_empty() {
        return Err(Error::spec(
            "folders",
            format!(
                "no folder matches `{pattern}`{}",
                if Path::new(pattern).is_absolute() {
                    ""
                } else {
                    " (relative to this file)"
                }
            ),
        ));
    }
    robots.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(robots)
}
