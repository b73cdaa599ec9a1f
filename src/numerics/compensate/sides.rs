//! On which side of shoulder, elbow and wrist an arm stands: what tells the joint positions apart that reach one pose.
//!
//! They are those of an arm of six revolute joints, with parallel axes 2 and 3 and a wrist whose axes meet in a point, the wrist centre.
//! Shoulder: the wrist centre is in front of axis 1, which is where it is when the controller shows zeros, or behind it. Elbow: the wrist centre
//! is beyond the line from axis 2 to axis 3 in the direction in which the controller counts joint 3 upwards, or short of it. Wrist: joint 5 is
//! turned upwards, as the controller counts, from where axes 4 and 6 are in line, or downwards. These are bits 0 to 2 of KUKA's status and
//! ABB's cfx.

use crate::robot::{JointConvention, RobotModel, Travel};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// m: axes that pass each other at a larger distance do not meet.
const MEET: f64 = 5e-3;

/// A side below this share (about 0.06 deg) is a border: the arm is on both.
const BORDER: f64 = 1e-3;

/// What is needed of a reference pose to tell two sides apart.
const CLEAR: f64 = 0.02;

/// The sides of an arm.
#[derive(Debug, Clone)]
pub struct ArmSides {
    /// At the zero pose, base frame.
    wrist_centre: Vector3<f64>,
    /// Signs of what the formulas give: shoulder, elbow, wrist.
    signs: [f64; 3],
    /// 1 where axes 4 and 6 of a straight wrist have one direction, else -1.
    in_line: f64,
}

/// How far an arm stands on each side of shoulder, elbow and wrist, as a share: 0 where it is singular.
pub type SideShares = [f64; 3];

/// A posture by its sides, true for those above zero; none where a side is free.
pub type StatedSides = [Option<bool>; 3];

impl ArmSides {
    /// The sides of an arm as a controller counts its joints; none where the arm has no such sides.
    pub fn of(robot: &RobotModel, convention: &JointConvention) -> Option<Self> {
        let elbowed = robot.joints() == 6
            && (0..6).all(|joint| robot.is_revolute(joint))
            && robot.is_parallel(1, 2);
        if !elbowed || robot.is_parallel(0, 1) {
            return None;
        }
        let wrist_centre = meeting(robot, [3, 4, 5])?;
        let mut zero = vec![0.0; 6];
        convention.to_robot(&mut zero);
        let plain = Self {
            wrist_centre,
            signs: [1.0; 3],
            in_line: 1.0,
        };
        let [front, ..] = plain.at(robot, &zero);
        let (_, in_line) = plain.wrist(robot, &zero);
        let sign = convention.sign();
        let clear = front.abs() > CLEAR && in_line.abs() > CLEAR;
        clear.then_some(Self {
            wrist_centre,
            signs: [front.signum(), sign[2], sign[4]],
            in_line: in_line.signum(),
        })
    }

    /// Where joints (rad, of the robot file) stand: above zero in front of axis 1, beyond the line from axis 2 to 3, with joint 5 turned upwards.
    pub fn at(&self, robot: &RobotModel, q: &[f64]) -> SideShares {
        let first = robot.motion(0, &Travel::new(q[0]));
        let second = first * robot.motion(1, &Travel::new(q[1]));
        let third = second * robot.motion(2, &Travel::new(q[2]));
        let centre = third.point(&self.wrist_centre);
        let out = centre - robot.point(0);
        let forward = (first.rotation * robot.axis(1))
            .cross(robot.axis(0))
            .normalize();
        let (shoulder, elbow) = (first.point(robot.point(1)), second.point(robot.point(2)));
        let axis = second.rotation * robot.axis(2);
        let across = |v: Vector3<f64>| (v - axis * axis.dot(&v)).normalize();
        let beyond = across(elbow - shoulder)
            .cross(&across(centre - elbow))
            .dot(&axis);
        [
            self.signs[0] * out.dot(&forward) / out.norm(),
            self.signs[1] * beyond,
            self.signs[2] * self.wrist(robot, q).0,
        ]
    }

    /// Whether joints stand on these sides; at a border both hold.
    pub(crate) fn hold(&self, robot: &RobotModel, q: &[f64], stated: &StatedSides) -> bool {
        let shares = self.at(robot, q);
        shares.iter().zip(stated).all(|(share, stated)| {
            stated.is_none_or(|above| (*share > 0.0) == above || share.abs() < BORDER)
        })
    }

    /// The joints at which the same pose is reached with the wrist turned over.
    pub(crate) fn turned_over(&self, robot: &RobotModel, q: &[f64]) -> Vec<f64> {
        let (sine, cosine) = self.wrist(robot, q);
        let mut out = q.to_vec();
        out[3] += PI;
        out[4] -= 2.0 * sine.atan2(cosine);
        out[5] += PI;
        out
    }

    /// Sine and cosine of the turn of joint 5 (of the robot file) from where axes 4 and 6 are in line.
    fn wrist(&self, robot: &RobotModel, q: &[f64]) -> (f64, f64) {
        let forearm = robot.axis(3);
        let fourth = robot.motion(3, &Travel::new(q[3]));
        let fifth = fourth * robot.motion(4, &Travel::new(q[4]));
        let (bend, last) = (
            fourth.rotation * robot.axis(4),
            fifth.rotation * robot.axis(5) * self.in_line,
        );
        (forearm.cross(&last).dot(&bend), forearm.dot(&last))
    }
}

/// The point in which axes meet at the zero pose, if they do.
fn meeting(robot: &RobotModel, joints: [usize; 3]) -> Option<Vector3<f64>> {
    let (mut normal, mut side) = (Matrix3::zeros(), Vector3::zeros());
    let across =
        |joint: usize| Matrix3::identity() - robot.axis(joint) * robot.axis(joint).transpose();
    for joint in joints {
        normal += across(joint);
        side += across(joint) * robot.point(joint);
    }
    let point = normal.try_inverse()? * side;
    joints
        .iter()
        .all(|joint| (across(*joint) * (point - robot.point(*joint))).norm() < MEET)
        .then_some(point)
}
