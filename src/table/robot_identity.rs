//! Whose model a table is: the robot's name, and a hash of its kinematics, without which numbers of one arm would move another.

use super::{Parameters, TorqueParameters};
use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Result};
use std::fmt::Write as _;

/// Parts of a metre and of a unit vector that count: what a unit is converted by and back moves less.
const PARTS: f64 = 1e9;
/// Hexadecimal digits of a hash.
const DIGITS: usize = 16;

/// A robot as its tables call it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct RobotIdentity {
    name: String,
    kinematics: String,
}

impl RobotIdentity {
    fn of(robot: &RobotDescription) -> Self {
        let mut text = String::new();
        let numbers = |vector: &[f64]| {
            vector
                .iter()
                .map(|x| format!(" {}", (x * PARTS).round() as i128))
                .collect::<String>()
        };
        for joint in &robot.joints {
            // What a sliding joint's point is changes nothing.
            let (kind, point) = match joint.kind {
                JointKind::Revolute => ("revolute", numbers(&joint.point)),
                JointKind::Prismatic => ("prismatic", String::new()),
            };
            writeln!(text, "{kind}{}{point}", numbers(&joint.axis)).expect("text grows");
        }
        for coupling in &robot.couplings {
            writeln!(
                text,
                "coupled {} {}{}",
                coupling.moved,
                coupling.by,
                numbers(&[coupling.ratio])
            )
            .expect("text grows");
        }
        let kinematics = blake3::hash(text.as_bytes()).to_hex()[..DIGITS].to_string();
        Self {
            name: robot.name.clone(),
            kinematics,
        }
    }

    /// Fails where a table of the kind `kind` with this identity is used for another robot.
    fn must_be(&self, other: &Self, kind: &str) -> Result<()> {
        let message = match (self.name == other.name, self.kinematics == other.kinematics) {
            (true, true) => return Ok(()),
            (false, true) => format!(
                "is the model of the robot `{}`, and this robot file is of `{}`, whose axes are the same: a model belongs to one arm; where this \
                 is that arm, give it its name in the robot file",
                self.name, other.name
            ),
            (false, false) => format!(
                "is the model of another robot, `{}`, whose axes are not those of `{}`: take the robot file that it was identified with",
                self.name, other.name
            ),
            (true, false) => format!(
                "is the model of `{}` with other axes than this robot file has: take the robot file that it was identified with, or identify anew",
                self.name
            ),
        };
        Err(Error::data(format!("table {kind}"), message))
    }
}

/// Gives a table the robot's columns, and refuses it for another robot; tables of earlier versions lack them.
macro_rules! of_one_robot {
    ($table:ident, $kind:literal) => {
        impl $table {
            /// The same as the model of this robot.
            pub fn of_robot(mut self, robot: &RobotDescription) -> Self {
                let RobotIdentity { name, kinematics } = RobotIdentity::of(robot);
                for row in &mut self.0 {
                    (row.robot, row.kinematics) = (Some(name.clone()), Some(kinematics.clone()));
                }
                self
            }

            /// Whether the table says of which robot it is.
            pub fn says_its_robot(&self) -> bool {
                self.0
                    .iter()
                    .all(|row| row.robot.is_some() && row.kinematics.is_some())
            }

            /// Fails where the table says that it is the model of another robot.
            pub fn must_be_of(&self, robot: &RobotDescription) -> Result<()> {
                let other = RobotIdentity::of(robot);
                let mut stated = self
                    .0
                    .iter()
                    .filter_map(|row| row.robot.clone().zip(row.kinematics.clone()));
                stated.try_for_each(|(name, kinematics)| {
                    RobotIdentity { name, kinematics }.must_be(&other, $kind)
                })
            }
        }
    };
}
of_one_robot!(Parameters, "parameters");
of_one_robot!(TorqueParameters, "torque_parameters");
