//! What a folder of files is, and the pipeline that reads it: columns by their names and values, how files belong together, and a robot
//! file to start from where none is there. All of it is a proposal; lines to look at are marked CHECK, numbers to fill in REPLACE.

mod arm;
mod columns;
mod lerobot;
mod names;
mod of_drives;
mod pipeline;
mod quantities;
mod sheet;
mod together;

pub(crate) use arm::{TYPICAL, typical};
pub(crate) use of_drives::{chain, start_drives};
pub(crate) use pipeline::{MarkedLines, marked};

use crate::error::{Error, Result};
use crate::robot::LibraryArm;
use arm::StartingArm;
use columns::ExaminedFile;
use pipeline::missing;
use quantities::examine;
use std::path::{Path, PathBuf};

pub(crate) struct InitRequest<'a> {
    /// The folder of robot.yaml and pipeline.yaml.
    pub(crate) folder: &'a Path,
    /// Recordings: one file, or the controller's and the tracker's.
    pub(crate) data: &'a [PathBuf],
    /// The kind to start from; none where nobody asked for one: the folder's own robot file, else the first kind.
    pub(crate) robot: Option<&'static LibraryArm>,
    /// The robot instead, and its last link; of a robot.yaml that is there the URDF that it refers to.
    pub(crate) urdf: Option<&'a Path>,
    /// Last link of the chain in the URDF.
    pub(crate) tip: &'a str,
}

pub(crate) struct StarterFiles {
    /// Text of `robot.yaml`; none where the folder has a robot file.
    pub(crate) robot: Option<String>,
    /// Name of the robot file.
    pub(crate) robot_file: &'static str,
    pub(crate) pipeline: String,
    /// What was found in each recording, and which.
    pub(crate) accounts: Vec<(PathBuf, String)>,
    pub(crate) missing: Vec<&'static str>,
    /// What a person should know of the robot, a sentence each.
    pub(crate) notes: Vec<String>,
}

impl StarterFiles {
    /// Whether recordings were given and neither joints nor points were found in them.
    pub(crate) fn understood_nothing(&self) -> bool {
        !self.accounts.is_empty() && self.missing.len() == 2
    }
}

/// Looks at the recordings. Fails where one cannot be read, or has another number of joints than the robot.
pub(crate) fn start(request: &InitRequest) -> Result<StarterFiles> {
    // Joints and points may stand in two sheets of one workbook.
    let places = if request.data.len() == 1 { 2 } else { 1 };
    let arm = StartingArm::of(request)?;
    let mut found: Vec<ExaminedFile> = Vec::new();
    for path in request.data {
        found.extend(examine(path, places, arm.joints)?);
    }
    let of_torques = arm::of_torques(&mut found);
    let more = together::other_reflectors(&mut found);
    if found.len() > 2 && !of_torques && !found.iter().all(together::is_whole) {
        let message = format!(
            "{} files; allowed: one recording, the controller's and the tracker's, the controller's and a list of points in one layout for each \
             of several reflectors, or recordings that have joints and points each",
            request.data.len()
        );
        return Err(Error::spec("--data", message));
    }
    let joints = found.iter().filter_map(ExaminedFile::joint_count).max();
    joints.map_or(Ok(()), |joints| arm.agrees(joints))?;
    let pipeline = if of_torques {
        pipeline::of_torques(request, &found, &arm)
    } else {
        let mut joined = together::join(&mut found);
        joined.extend(pipeline::later(request.folder, &found, &more));
        pipeline::text(request, &found, (&joined, &arm))
    };
    let is_asked = !found.is_empty() && !of_torques;
    let unknown = ["columns of joints", "the measured point"];
    let unknown = unknown.into_iter().zip(missing(&found));
    let files = found.iter().chain(more.iter().map(|(_, file)| file));
    Ok(StarterFiles {
        robot_file: arm.file.name,
        robot: match of_torques {
            true => arm.text.map(|text| arm::without_point(&text)),
            false => arm.text,
        },
        pipeline,
        accounts: files
            .map(|file| (file.path.clone(), file.account()))
            .collect(),
        missing: unknown
            .filter(|(_, missing)| *missing && is_asked)
            .map(|(what, _)| what)
            .collect(),
        notes: arm.notes,
    })
}
