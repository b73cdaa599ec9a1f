//! Where the flange of an arm is: as the robot file's kinematics end, or as the library has it for an arm of that geometry.

use super::Export;
use crate::description::RobotDescription;
use crate::raw::{self, ending};
use crate::robot::LIBRARY;
use crate::robot::import::{Imported, RobotFileText, read_calib};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

/// Direction and place within which an axis is that of an arm of the library, rad and m.
const SAME: f64 = 1e-6;

impl Export {
    /// The flange at the zero pose in the base frame, and who says so; none where neither the robot file nor the library does.
    pub(super) fn flange(&self) -> Option<(Pose, String)> {
        let of_the_file = self.imported().and_then(|imported| {
            Some((
                imported.flange?,
                "as the kinematics of the robot file end".into(),
            ))
        });
        let robot = &self.identified.robot;
        let arms = || {
            LIBRARY
                .iter()
                .filter_map(|arm| Some((arm.name, arm.read().ok()?)))
        };
        let of_the_library = || {
            let (name, arm) = arms().find(|(_, arm)| is_same_arm(&arm.robot, robot))?;
            let rows = arm.robot.tool_rotation;
            let turn = Matrix3::from_fn(|i, k| rows[i][k]);
            let flange = Pose::new(turn, arm.robot.tool.into());
            Some((flange, format!("as the library has it for {name}")))
        };
        of_the_file.or_else(of_the_library)
    }

    /// The robot file behind the model, read once more; none where it is gone or is another one by now.
    pub(super) fn imported(&self) -> Option<Imported> {
        let sources = &self.identified.sources;
        let with_ending = |wanted: [&str; 2]| -> Vec<(String, String)> {
            let found = sources
                .iter()
                .filter(|path| wanted.contains(&ending(path).as_str()));
            let read = |path: &std::path::PathBuf| {
                Some((path.display().to_string(), raw::text(path).ok()?))
            };
            found.filter_map(read).collect()
        };
        let urdfs = with_ending(["urdf", "xml"]);
        let urdf = urdfs
            .first()
            .map(|(label, text)| RobotFileText { label, text });
        let files = with_ending(["yaml", "yml"]);
        let read =
            |(label, text): &(String, String)| read_calib(RobotFileText { label, text }, urdf).ok();
        files
            .iter()
            .filter_map(read)
            .find(|imported| imported.robot == self.identified.robot)
    }
}

/// Whether the joints of two arms are the same, wherever their tools are.
fn is_same_arm(ours: &RobotDescription, theirs: &RobotDescription) -> bool {
    let pairs = ours.joints.iter().zip(&theirs.joints);
    ours.joints.len() == theirs.joints.len()
        && pairs.into_iter().all(|(ours, theirs)| {
            let axis = Vector3::from(ours.axis);
            let away = Vector3::from(ours.point) - Vector3::from(theirs.point);
            let apart = (away - axis * axis.dot(&away)).norm();
            ours.kind == theirs.kind
                && (axis - Vector3::from(theirs.axis)).norm() < SAME
                && apart < SAME
        })
}
