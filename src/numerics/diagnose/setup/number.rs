//! One number of the robot file that may be wrong: a length between two axes, the place of one axis, or the zero of a joint.

use crate::robot::RobotModel;
use crate::setup::placement::bodies;
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

/// A number, or the three of a displacement, to be found from the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FreeNumber {
    /// All behind the link that joint `.0` (from 0) moves stands elsewhere: base axes at the zero pose, m.
    Length(usize),
    /// The axis of a joint alone stands elsewhere, m.
    Axis(usize),
    /// The zero of a joint, rad.
    Zero(usize),
}

/// What a row sees of it: the last body, a displacement of the point, and the motion of the point by each number, base frame.
pub(super) struct SeenNumber {
    pub(crate) body: Pose,
    pub(crate) shift: Vector3<f64>,
    pub(crate) columns: Vec<Vector3<f64>>,
}

impl FreeNumber {
    /// All that a robot has.
    pub(crate) fn all(robot: &RobotModel) -> Vec<Self> {
        let turning = (0..robot.joints()).filter(|joint| robot.is_revolute(*joint));
        let lengths = (0..robot.joints().saturating_sub(1)).map(Self::Length);
        // The first zero is the base's, the last one the tool's.
        let zeros = turning
            .clone()
            .filter(|joint| (1..robot.joints().saturating_sub(1)).contains(joint))
            .map(Self::Zero);
        lengths
            .chain(turning.filter(|joint| *joint > 0).map(Self::Axis))
            .chain(zeros)
            .collect()
    }

    pub(crate) fn width(self) -> usize {
        if matches!(self, Self::Zero(_)) { 1 } else { 3 }
    }

    /// What a row sees of it at joint positions `q`; `seat` is where the point sits at the zero pose.
    pub(crate) fn seen(
        self,
        robot: &RobotModel,
        q: &[f64],
        values: &[f64],
        seat: &Vector3<f64>,
    ) -> SeenNumber {
        let displaced = |body: Pose, by: Matrix3<f64>| {
            let columns: Vec<Vector3<f64>> = (0..3).map(|axis| by.column(axis).into()).collect();
            let shift = columns
                .iter()
                .zip(values)
                .map(|(column, value)| column * *value)
                .sum();
            SeenNumber {
                body,
                shift,
                columns,
            }
        };
        match self {
            Self::Length(joint) => {
                let all = bodies(robot, q);
                displaced(all[robot.joints()], all[joint + 1].rotation)
            }
            Self::Axis(joint) => {
                let all = bodies(robot, q);
                displaced(
                    all[robot.joints()],
                    all[joint].rotation - all[joint + 1].rotation,
                )
            }
            Self::Zero(joint) => {
                let mut turned = q.to_vec();
                turned[joint] += values[0];
                let all = bodies(robot, &turned);
                let body = all[robot.joints()];
                let arm = body.point(seat) - all[joint].point(robot.point(joint));
                let column = (all[joint].rotation * robot.axis(joint)).cross(&arm);
                SeenNumber {
                    body,
                    shift: Vector3::zeros(),
                    columns: vec![column],
                }
            }
        }
    }
}
