//! Stage `robot`: a robot file -> the `robot` table.

use super::{Context, RawFile, Stage};
use crate::error::{Place, Result};
use crate::robot::import::{RobotFileText, read_calib, read_case};
use crate::table::Robot;
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
}

crate::stage::stage! {
    ReadRobot, "robot", 2, "reads a robot file (screws, DH, modified DH, URDF, or a practice robot.json)",
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
        let urdf = self
            .urdf
            .iter()
            .map(|file| ("urdf".to_string(), file.clone()));
        std::iter::once(("file".to_string(), self.file.clone()))
            .chain(urdf)
            .collect()
    }

    fn look(&self, reads: Option<RobotReads>, context: &Context) -> Result<Option<RobotWrites>> {
        reads.map(|reads| self.run(reads, context)).transpose()
    }

    fn run(&self, _reads: RobotReads, context: &Context) -> Result<RobotWrites> {
        let (label, text) = context.text(&self.file, WHAT, MOST_BYTES)?;
        let file = RobotFileText {
            label: &label,
            text: &text,
        };
        let imported = match self.format {
            RobotFormat::Case => read_case(file)?,
            RobotFormat::Calib => {
                let urdf = self
                    .urdf
                    .as_ref()
                    .map(|file| context.text(file, WHAT, MOST_BYTES))
                    .transpose()?;
                read_calib(
                    file,
                    urdf.as_ref()
                        .map(|(label, text)| RobotFileText { label, text }),
                )?
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
