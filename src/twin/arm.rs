//! The true arm: the description with its manufacturing errors in, and where its bodies are.
//!
//! Frame j sits on body j with its origin on the axis of joint j; at the zero pose of the nominal arm it is parallel to the base.
//! `T_j = T_(j-1) * (span and elastic motion of link j-1) * (motion of joint j)`.

use super::matrix::{self, Matrix, Vector};
use super::motion::Motion;
use super::truth::TrueRobot;
use calib_foundation::description::{JointKind, RobotDescription};

/// A joint with the link that it moves, in the frame of that link.
#[derive(Debug, Clone)]
pub struct Link {
    /// Whether the joint turns; else it slides.
    pub(crate) revolute: bool,
    /// Unit vector.
    pub(crate) axis: Vector,
    /// From the origin of this link to the next joint (the last: to the measured point), m, errors included.
    pub(crate) span: Vector,
    /// What the next joint is tilted by; identity for the last.
    pub(crate) tilt: Matrix,
    /// kg, and its centre in the frame of the link, m.
    pub(crate) mass: f64,
    /// Centre of its mass, m.
    pub(crate) centre: Vector,
    /// Motor turns per turn of the joint; 1 where unknown.
    pub gear: f64,
    /// Torque at the motor per ampere, Nm/A; 1 where unknown.
    pub motor_constant: f64,
}

/// A robot as it really is, but for what changes from row to row.
#[derive(Debug, Clone)]
pub struct Arm {
    /// From the base to joint 1, m.
    pub(crate) foot: Vector,
    /// From base to tool.
    pub links: Vec<Link>,
    /// Centre of the payload in the frame of the last link, m.
    pub(crate) payload_centre: Vector,
    /// True mass of the payload per declared mass.
    pub(crate) payload_share: f64,
    /// m/s2, base frame.
    pub(crate) gravity: Vector,
}

/// Where everything is, in the base frame.
#[derive(Debug, Clone)]
pub struct Posture {
    /// The frame of every link.
    pub(crate) frames: Vec<Matrix>,
    /// The axis of every joint as a direction.
    pub(crate) axes: Vec<Vector>,
    /// The measured point, m.
    pub tool: Vector,
}

impl Arm {
    /// The description with the errors of `truth` in.
    pub fn new(robot: &RobotDescription, truth: &TrueRobot) -> Arm {
        let last = robot.joints.len().saturating_sub(1);
        let links = robot.joints.iter().enumerate().map(|(index, joint)| {
            let end = robot
                .joints
                .get(index + 1)
                .map_or(robot.tool, |next| next.point);
            let error = truth.link_error(index);
            Link {
                revolute: joint.kind == JointKind::Revolute,
                axis: joint.axis,
                span: matrix::add(matrix::minus(end, joint.point), error.shift),
                tilt: if index == last {
                    matrix::IDENTITY
                } else {
                    matrix::turn_by(error.tilt)
                },
                mass: joint.mass.unwrap_or(0.0),
                centre: joint
                    .centre
                    .map_or([0.0; 3], |centre| matrix::minus(centre, joint.point)),
                gear: joint.reduction_ratio.unwrap_or(1.0),
                motor_constant: joint.motor_constant.unwrap_or(1.0),
            }
        });
        let links = links.collect();
        let hand = robot.joints.last().map_or([0.0; 3], |joint| joint.point);
        Arm {
            foot: robot.joints.first().map_or([0.0; 3], |joint| joint.point),
            links,
            payload_centre: matrix::minus(robot.payload_centre, hand),
            payload_share: 1.0,
            gravity: robot.gravity,
        }
    }

    /// The posture at joint positions `angle` (rad or m) with the elastic and other motions of `motion` in.
    pub fn posture(&self, angle: &[f64], motion: &Motion) -> Posture {
        let mut frames = Vec::with_capacity(self.links.len());
        let mut axes = Vec::with_capacity(self.links.len());
        let mut at = matrix::times(&motion.base, &matrix::shift(self.foot));
        for (index, link) in self.links.iter().enumerate() {
            axes.push(matrix::direct(&at, link.axis));
            let moved = if link.revolute {
                matrix::turn(link.axis, angle[index])
            } else {
                matrix::shift(matrix::scale(link.axis, angle[index]))
            };
            let frame = matrix::times(&at, &moved);
            frames.push(frame);
            at = matrix::times(&frame, &matrix::shift(link.span));
            at = matrix::times(&at, &motion.link_end[index]);
            at = matrix::times(&at, &link.tilt);
        }
        Posture {
            tool: matrix::place(&at, motion.tool),
            frames,
            axes,
        }
    }
}
