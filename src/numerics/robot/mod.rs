//! The robot as data, its import, its screws and its gravity torques.

mod column;
pub mod import;
mod instrument;
mod joint_convention;
mod library;
mod measurements;
mod memory;
mod model;
pub mod pose_groups;
mod posture;
mod readings;
mod rows;
mod setup;

pub(crate) use column::columns;
pub use column::{
    CIRCUMSTANCES, CircumstanceName, ColumnShape, Convention, Conventions, DeclaredColumn, Part,
    law_columns,
};
pub use instrument::{
    INSTRUMENTS, Instrument, NoiseBasis, PublishedInstrument, START, SigmaSource,
};
pub use joint_convention::{CountedCoupling, JointConvention};
pub use library::{LIBRARY, LibraryArm};
pub use measurements::{Measurements, Memories, RowTime};
pub(crate) use memory::range;
pub use memory::{Memory, Unmeasured, Visited, numbered};
pub use model::{Bound, ONE_AND_A_HALF_TURNS, RobotModel, Travel, too_far};
pub use pose_groups::Sequence;
pub use posture::{Carried, LoadCorrection, Posture};
pub use readings::{Named, PointReadings, Reading, Readings};
pub use rows::{DhRow, DhTable};
pub use setup::{Anchor, MeasurementSetup, Shape, Target};

#[cfg(test)]
pub(crate) use tests::small_arm;

#[cfg(test)]
mod tests {
    use super::RobotModel;
    use super::import::{RobotFileText, read_calib};

    const FILE: &str = "calib_robot: 1
name: small
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 400]}
tool: {point: [500, 0, 400]}
joints: [{name: A1}, {name: A2}]
";

    /// The arm: about the vertical, then about a level axis 400 mm up; the point 500 mm out.
    pub(crate) fn small_arm() -> RobotModel {
        RobotModel::new(
            read_calib(RobotFileText::new("robot.yaml", FILE), None)
                .expect("a robot")
                .robot,
        )
    }
}
