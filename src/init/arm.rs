//! The arm that a recording is of: a file that is there already, a URDF, or a kind to start from.

use super::robots::{self, RobotFileKind};
use super::{InitRequest, KINDS};
use crate::description::JointKind;
use crate::error::{Error, Result, counted};
use crate::raw;
use crate::robot::import::{RobotFileText, UrdfOutline, read_calib, urdf_outline};
use std::path::Path;

/// What recordings and pipeline must know of the arm.
pub(super) struct StartingArm {
    /// Text of its robot file; none where the folder has one.
    pub text: Option<String>,
    pub joints: usize,
    /// Which of them slide, where one does.
    pub sliding: Vec<bool>,
    /// How its controller counts joints, as settings of `q`.
    pub counting: Option<String>,
    /// What a person should know of the robot, a sentence each.
    pub notes: Vec<String>,
    /// Where another number of joints is said, and how.
    other: (&'static str, String),
}

impl StartingArm {
    /// Fails where a file cannot be read, or is there and another arm is asked for.
    pub fn of(request: &InitRequest) -> Result<Self> {
        let file = request.folder.join("robot.yaml");
        if file.exists() {
            return Self::there(request, &file);
        }
        let Some(urdf) = request.urdf else {
            return Self::to_start_from(request.robot.unwrap_or(KINDS[0]));
        };
        let (label, text) = read(urdf)?;
        let UrdfOutline {
            base,
            sliding,
            notes,
        } = urdf_outline(
            RobotFileText {
                label: &label,
                text: &text,
            },
            request.tip,
        )?;
        let chain = format!(
            "the chain from `{base}` to `{}` has {}",
            request.tip,
            counted(sliding.len(), "joint")
        );
        Ok(Self {
            text: Some(robots::of_urdf(&base, request.tip)),
            joints: sliding.len(),
            sliding,
            counting: None,
            notes,
            other: (
                "--tip",
                format!(
                    "{chain}, the recording {{}}; name the last link that moves, or one fixed to it"
                ),
            ),
        })
    }

    fn there(request: &InitRequest, file: &Path) -> Result<Self> {
        let (label, text) = read(file)?;
        if request.robot.is_some() {
            return Err(Error::spec(
                label,
                "is already there and would be used: leave out --robot, or move the file away",
            ));
        }
        let urdf = request.urdf.map(read).transpose()?;
        let urdf = urdf
            .as_ref()
            .map(|(label, text)| RobotFileText { label, text });
        let read = read_calib(
            RobotFileText {
                label: &label,
                text: &text,
            },
            urdf,
        )?;
        let sliding: Vec<bool> = read
            .robot
            .joints
            .iter()
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect();
        let own = counted(sliding.len(), "joint");
        Ok(Self {
            text: None,
            joints: sliding.len(),
            sliding,
            counting: read.about.counting(),
            notes: Vec::new(),
            other: (
                "robot.yaml",
                format!(
                    "{label} has {own}, the recording {{}}; put the robot of the recording there"
                ),
            ),
        })
    }

    fn to_start_from(kind: RobotFileKind) -> Result<Self> {
        let (joints, name) = (kind.joints()?, kind.name());
        Ok(Self {
            text: Some(kind.text()),
            joints,
            sliding: Vec::new(),
            counting: kind.counting()?,
            notes: Vec::new(),
            other: (
                "--robot",
                format!(
                    "{name} has {}, the recording {{}}; choose another kind",
                    counted(joints, "joint")
                ),
            ),
        })
    }

    /// Fails unless a recording has as many joints.
    pub fn agrees(&self, joints: usize) -> Result<()> {
        let (place, message) = &self.other;
        if joints == self.joints {
            Ok(())
        } else {
            Err(Error::spec(
                *place,
                message.replace("{}", &joints.to_string()),
            ))
        }
    }
}

fn read(path: &Path) -> Result<(String, String)> {
    let label = path.display().to_string();
    let text =
        raw::text(path).map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
    Ok((label, text))
}
