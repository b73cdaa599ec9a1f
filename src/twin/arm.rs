//! The true arm: the description with its manufacturing errors in, and where its bodies are.
//!
//! Frame j sits on body j with its origin on the axis of joint j; at the zero pose of the nominal arm it is parallel to the base.
//! `T_j = T_(j-1) * (span and elastic motion of link j-1) * (motion of joint j)`.

use crate::matrix;
use crate::matrix::{IDENTITY, Matrix, Vector};
use crate::truth::{ARCSEC, TrueRobot};
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

impl Posture {
    /// Whether no joint is lower than this, m; joints up to the second stand on the base, which may reach to the floor.
    pub(crate) fn is_above(&self, floor: f64) -> bool {
        let mut frames = self.frames.iter().skip(2);
        frames.all(|frame| frame[2][3] >= floor)
    }
}

impl Arm {
    /// The description with the errors of `truth` in.
    pub fn new(robot: &RobotDescription, truth: &TrueRobot) -> Arm {
        let last = robot.joints.len().saturating_sub(1);
        let links = robot.joints.iter().enumerate().map(|(index, joint)| {
            let next = robot.joints.get(index + 1);
            let end = next.map_or(robot.tool, |next| next.point);
            let error = truth.link_error(index);
            Link {
                revolute: joint.kind == JointKind::Revolute,
                axis: joint.axis,
                span: matrix::add(matrix::minus(end, joint.point), error.shift),
                tilt: match index == last {
                    true => matrix::IDENTITY,
                    false => matrix::turn_by(error.tilt),
                },
                mass: joint.mass.unwrap_or(0.0),
                centre: matrix::minus(joint.centre.unwrap_or(joint.point), joint.point),
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

/// A share of a rigid step: a shift (um) after a rotation vector (arcsec).
pub(crate) fn step(shift_um: Vector, turn_arcsec: Vector, share: f64) -> Matrix {
    let moved = matrix::shift(matrix::scale(shift_um, 1e-6 * share));
    let turned = matrix::turn_by(matrix::scale(turn_arcsec, ARCSEC * share));
    matrix::times(&moved, &turned)
}

/// What effects do to the arm.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Motion of the tracker's frame.
    pub(crate) tracker: Matrix,
    /// Motion of the base, base frame.
    pub(crate) base: Matrix,
    /// Added to each joint, rad or m.
    pub joint: Vec<f64>,
    /// Motion of each link's far end, in the frame of the link, about that end.
    pub(crate) link_end: Vec<Matrix>,
    /// Shift of the measured point, last link's frame, m.
    pub(crate) tool: Vector,
    /// What turns each joint in addition to gravity, Nm: springs and hoses. The gear carries it too.
    pub(crate) load: Vec<f64>,
    /// What each motor carries in addition to gravity, Nm at the joint.
    pub(crate) motor_torque: Vec<f64>,
}

impl Motion {
    /// No motion of an arm with so many joints.
    pub fn none(joints: usize) -> Motion {
        Motion {
            tracker: IDENTITY,
            base: IDENTITY,
            joint: vec![0.0; joints],
            link_end: vec![IDENTITY; joints],
            tool: [0.0; 3],
            load: vec![0.0; joints],
            motor_torque: vec![0.0; joints],
        }
    }

    /// Moves the base about a point of it, m.
    pub(crate) fn move_base(&mut self, pivot: Vector, by: &Matrix) {
        let about = matrix::times(by, &matrix::shift(matrix::scale(pivot, -1.0)));
        self.base = matrix::times(&self.base, &matrix::times(&matrix::shift(pivot), &about));
    }

    /// Moves the far end of a link (from 0), in its frame.
    pub(crate) fn move_end(&mut self, link: usize, by: &Matrix) {
        self.link_end[link] = matrix::times(&self.link_end[link], by);
    }

    /// Moves the axis of a joint (from 0), seen from the body that carries it; the first stands on the base, at its foot.
    pub(crate) fn move_axis(&mut self, foot: Vector, joint: usize, by: &Matrix) {
        match joint.checked_sub(1) {
            Some(link) => self.move_end(link, by),
            None => self.move_base(foot, by),
        }
    }

    /// The largest difference of any number, rad, m or Nm; the motors' torque does not move the arm.
    pub(crate) fn distance(&self, other: &Motion) -> f64 {
        let tool = matrix::norm(matrix::minus(self.tool, other.tool));
        let pairs = self.numbers().zip(other.numbers());
        pairs.map(|(a, b)| (a - b).abs()).fold(tool, f64::max)
    }

    /// All numbers but those of the tool and of the motors.
    fn numbers(&self) -> impl Iterator<Item = f64> {
        let matrices = self.link_end.iter().chain([&self.base, &self.tracker]);
        let joints = self.joint.iter().chain(&self.load);
        let numbers = joints.chain(matrices.flat_map(|matrix| matrix.as_flattened()));
        numbers.copied()
    }
}

/// Bodies with weight, in the base frame: the link that carries it (the payload: one past the last), mass in kg, centre.
#[derive(Debug, Clone)]
pub(crate) struct Loads {
    bodies: Vec<(usize, f64, Vector)>,
    gravity: Vector,
}

impl Loads {
    /// The links and the declared payload (kg) of an arm in `posture`.
    pub(crate) fn new(arm: &Arm, posture: &Posture, payload: f64) -> Loads {
        let links = arm.links.iter().zip(&posture.frames);
        let links = links.map(|(link, frame)| (link.mass, matrix::place(frame, link.centre)));
        // Beyond the last link: it bends that link too.
        let carried = posture.frames.last().map(|hand| {
            let centre = matrix::place(hand, arm.payload_centre);
            (payload * arm.payload_share, centre)
        });
        let all = links.chain(carried).enumerate();
        let bodies = all
            .map(|(link, (mass, centre))| (link, mass, centre))
            .collect();
        Loads {
            bodies,
            gravity: arm.gravity,
        }
    }

    /// Force (N) and moment about `point` (Nm) of the weight of everything from link `from` (from 0) on, base frame.
    pub(crate) fn wrench(&self, from: usize, point: Vector) -> (Vector, Vector) {
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for (_, mass, centre) in self.bodies.iter().filter(|(link, _, _)| *link >= from) {
            let weight = matrix::scale(self.gravity, *mass);
            force = matrix::add(force, weight);
            moment = matrix::add(moment, matrix::cross(matrix::minus(*centre, point), weight));
        }
        (force, moment)
    }

    /// What gravity does to each joint along its axis, Nm (N for a prismatic joint).
    pub(crate) fn torques(&self, arm: &Arm, posture: &Posture) -> Vec<f64> {
        let along = |(index, link): (usize, &Link)| {
            let (force, moment) = self.wrench(index, matrix::origin(&posture.frames[index]));
            let pull = if link.revolute { moment } else { force };
            matrix::dot(posture.axes[index], pull)
        };
        arm.links.iter().enumerate().map(along).collect()
    }
}

/// What holds in one row in addition to the loads.
#[derive(Debug, Clone)]
pub struct Row {
    /// Joint positions that the controller reports, rad or m.
    pub command: Vec<f64>,
    /// Joint positions at the gears' outputs without load, rad or m.
    pub drive: Vec<f64>,
    /// +1, -1 or 0: last move of each joint.
    pub direction: Vec<f64>,
    pub time_s: f64,
    pub temperature_c: f64,
    /// Declared, kg.
    pub payload_kg: f64,
    /// Velocity of each joint, rad/s or m/s; empty where the arm stands.
    pub velocity: Vec<f64>,
    /// What each effect that acts makes of the rows before, in the order of the effects; empty: they make nothing of them.
    pub memory: Vec<f64>,
}
