//! Stage `robot`: a robot file -> the `robot` table.

use super::{Context, RawFile, Stage};
use crate::error::{Place, Result};
use crate::table::Robot;
use calib_numerics::robot::import::{RobotFileText, read_calib, read_case};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

// Bytes; the largest URDF we know is 200 kB. A recording named here by mistake must not fill the memory.
const MOST_BYTES: u64 = 16 << 20;
const WHAT: &str = "a robot file";

/// How the robot file is laid out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RobotFormat {
    /// calib's own YAML.
    #[default]
    Calib,
    /// `robot.json` of a practice folder.
    Case,
}

/// Reads the robot as its owner believes it to be.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReadRobot {
    /// The robot file.
    pub file: RawFile,
    /// Layout of the robot file.
    #[serde(default)]
    pub format: RobotFormat,
    /// The URDF that `kinematics: {urdf: {base: .., tip: ..}}` of the robot file refers to.
    #[serde(default)]
    pub urdf: Option<RawFile>,
    /// The arm's MJCF, which is not read here: `calib export --format mjcf` writes what was identified of torques into a copy of it.
    #[serde(default)]
    pub mjcf: Option<RawFile>,
}

crate::stage! {
    ReadRobot, "robot", 3, "reads a robot file (screws, DH, modified DH, URDF, or a practice robot.json)",
        RobotReads {} -> RobotWrites {
            robot: Robot,
        }
}

impl Stage for ReadRobot {
    fn faults(&self, at: &mut Place) {
        let possible = self.format == RobotFormat::Calib || self.urdf.is_none();
        at.at("urdf")
            .must(possible, "the format `case` takes no URDF");
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let urdf = self.urdf.iter().map(|file| ("urdf".into(), file.clone()));
        let mjcf = self.mjcf.iter().map(|file| ("mjcf".into(), file.clone()));
        let file = [("file".into(), self.file.clone())];
        file.into_iter().chain(urdf).chain(mjcf).collect()
    }

    fn look(&self, reads: Option<RobotReads>, context: &Context) -> Result<Option<RobotWrites>> {
        reads.map(|reads| self.run(reads, context)).transpose()
    }

    fn run(&self, _reads: RobotReads, context: &Context) -> Result<RobotWrites> {
        fn labelled((label, text): &(String, String)) -> RobotFileText<'_> {
            RobotFileText { label, text }
        }
        let read = |file: &RawFile| context.text(file, WHAT, MOST_BYTES);
        let file = read(&self.file)?;
        let imported = match self.format {
            RobotFormat::Case => read_case(labelled(&file))?,
            RobotFormat::Calib => {
                let urdf = self.urdf.as_ref().map(read).transpose()?;
                read_calib(labelled(&file), urdf.as_ref().map(labelled))?
            }
        };
        for note in imported.notes {
            context.warn(note);
        }
        Ok(RobotWrites {
            robot: Robot::from_description(&imported.robot),
        })
    }
}
